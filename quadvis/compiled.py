"""A block's methods compiled by numba, from the same source and over the same memory as the interpreted ones.

Each method becomes a C function of pointers: to the block's record, to each argument and to each result. The native
tier will call these from one compiled loop; today the conformance suite holds them against the interpreted methods.
"""

from __future__ import annotations

import ctypes
import types
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from quadvis.block import Block
from quadvis.memory import SLOT, Memory, Record, Slot


def compile_method(
    block: type[Block], method: str, record: Record, arguments: Sequence[Slot], targets: Sequence[Slot]
) -> Callable[[Memory, int], None]:
    """Return ``call(memory, position)``, which runs a compiled method on the record at a position.

    The slots give kinds and shapes, which are compiled in, and the places, which are not. numba's own errors pass
    through: they name the line that it cannot compile.
    """
    import numba

    body = _jit(getattr(block, method), {})
    names = [f"p{i}" for i in range(len(arguments) + len(targets))]
    reads = ", ".join(
        f"carray({name}, {slot.shape})" if slot.shape else f"{name}[0]"
        for name, slot in zip(names, arguments, strict=False)
    )
    results = names[len(arguments) :]
    lines = [f"def call(record, {', '.join(names)}):", "    self = carray(record, 1)[0]"]
    lines.append(f"    {', '.join(f'r_{name}' for name in results)}{' = ' if results else ''}body(self, {reads})")
    for name, slot in zip(results, targets, strict=True):
        lines.append(f"    carray({name}, {slot.shape})[...] = r_{name}" if slot.shape else f"    {name}[0] = r_{name}")
    namespace: dict[str, Any] = {"carray": numba.carray, "body": body}
    exec("\n".join(lines), namespace)
    pointers = [numba.types.CPointer(numba.from_dtype(np.dtype(slot.scalar))) for slot in (*arguments, *targets)]
    signature = numba.void(numba.types.CPointer(numba.from_dtype(record.dtype)), *pointers)
    function = numba.cfunc(signature, error_model="numpy")(namespace["call"])
    native = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * (len(names) + 1))(function.address)
    places = [slot.position * SLOT for slot in (*arguments, *targets)]

    def call(memory: Memory, position: int) -> None:
        base = ctypes.addressof(ctypes.c_char.from_buffer(memory.bytes))
        native(base + position * SLOT, *[base + place for place in places])

    call.function = function  # type: ignore[attr-defined]  # keeps the machine code alive
    return call


def _jit(function: Any, known: dict[Any, Any]) -> Any:
    """Compile a plain function, and the plain functions of the library that it calls, from their source.

    Done afresh for each block: numba's own cache does not see edits in the files of called functions.
    """
    import numba

    if function not in known:
        scope = dict(function.__globals__)
        copy = types.FunctionType(function.__code__, scope, function.__name__, function.__defaults__, function.__closure__)
        known[function] = numba.njit(copy, error_model="numpy")
        for name in function.__code__.co_names:
            value = scope.get(name)
            if isinstance(value, types.FunctionType):
                scope[name] = _jit(value, known)
    return known[function]
