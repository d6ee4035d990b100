"""Calls of machine code by its address, from code that is compiled.

The functions here are only names: `intrinsics` gives what compiled code has in their place.
"""

from __future__ import annotations

import functools
from typing import Any


def invoke(address: int, places: int) -> int:
    """Call a function of the one form of this room, ``int32 f(int64 *places)``."""
    raise NotImplementedError


def system(address: int, a: int, b: int, c: int, d: int) -> int:
    """Call a function of the C library that takes up to four whole numbers or addresses."""
    raise NotImplementedError


@functools.cache
def intrinsics() -> dict[Any, Any]:
    """Return what stands for the functions here in compiled code."""
    from llvmlite import ir
    from numba import types as kinds
    from numba.extending import intrinsic

    pointer, word, status = ir.IntType(8).as_pointer(), ir.IntType(64), ir.IntType(32)

    def called(builder: Any, values: Any, arguments: Any) -> Any:
        form = ir.FunctionType(status, [argument.type for argument in arguments])
        return builder.call(builder.inttoptr(values[0], form.as_pointer()), arguments)

    @intrinsic
    def invoked(_: Any, address: Any, places: Any) -> Any:
        def emit(_: Any, builder: Any, __: Any, values: Any) -> Any:
            return called(builder, values, [builder.inttoptr(values[1], pointer)])

        return kinds.int32(address, places), emit

    @intrinsic
    def asked(_: Any, address: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
        def emit(_: Any, builder: Any, __: Any, values: Any) -> Any:
            return called(builder, values, [builder.sext(value, word) for value in values[1:]])

        return kinds.int32(address, a, b, c, d), emit

    return {invoke: invoked, system: asked}
