"""A block's methods compiled by numba, from the same source and over the same memory as the interpreted ones.

Each method becomes a C function of pointers: to the block's record, to each argument and to each result. The
native tier will call these from one compiled loop; today the conformance suite holds them against the
interpreted methods.
"""

from __future__ import annotations

import ast
import ctypes
import inspect
import textwrap
import types
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from quadvis.block import Block
from quadvis.engine.memory import SLOT, Memory, Record, Slot, packed

Compiled = Callable[[Memory, int], None]


class Compiler:
    """Compiles the methods of one block type; the helper functions that they share are compiled once.

    Done afresh in each process: numba's own cache does not see edits in the files of called functions.
    """

    def __init__(self, block: type[Block], record: Record) -> None:
        self.block, self.record = block, record
        self._known: dict[Any, Any] = {}

    def compile(self, method: str, arguments: Sequence[Slot], targets: Sequence[Slot]) -> Compiled:
        """Return ``call(memory, position)``, which runs a compiled method on the record at a position.

        The slots give kinds and shapes, which are compiled in, and the places, which are not. numba's own
        errors pass through: they name the line that it cannot compile.
        """
        import numba

        slots = (*arguments, *targets)
        body = self._jit(_with_array_stores(getattr(self.block, method), self.record))
        namespace: dict[str, Any] = {"carray": vars(numba)["carray"], "body": body}
        exec(_wrapper(arguments, targets), namespace)
        kinds: Any = numba.types
        pointers = [kinds.CPointer(_pointed(slot)) for slot in slots]
        signature = numba.void(kinds.CPointer(numba.from_dtype(self.record.dtype)), *pointers)
        function: Any = numba.cfunc(signature, error_model="numpy")(namespace["call"])
        native = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * (len(slots) + 1))(function.address)
        places = [slot.position * SLOT for slot in slots]

        def call(memory: Memory, position: int) -> None:
            base = ctypes.addressof(ctypes.c_char.from_buffer(memory.raw))
            native(base + position * SLOT, *[base + place for place in places])

        call.__dict__["function"] = function  # keeps the machine code alive
        return call

    def _jit(self, function: Any) -> Any:
        """Compile a plain function and the plain functions that it calls."""
        import numba

        if function not in self._known:
            scope = dict(function.__globals__)
            copy = types.FunctionType(
                function.__code__, scope, function.__name__, function.__defaults__, function.__closure__
            )
            self._known[function] = numba.njit(copy, error_model="numpy")
            for name in names_in(function.__code__):
                if isinstance(scope.get(name), types.FunctionType):
                    scope[name] = self._jit(scope[name])
        return self._known[function]


def names_in(code: types.CodeType) -> Iterator[str]:
    """Yield the names of globals and attributes in a function and in what is nested in it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from names_in(constant)


def _pointed(slot: Slot) -> Any:
    """Return numba's type for the target of a slot's pointer; numba cannot store through pointers to bool."""
    import numba

    return (
        numba.uint8
        if slot.scalar == "bool" and not slot.shape
        else numba.from_dtype(packed(slot.scalar, slot.shape))
    )


class _ArrayStores(ast.NodeTransformer):
    """Turns ``self.last = value`` into ``self.last[...] = value`` where ``last`` is an array.

    Interpreted, the two are the same; numba gives the fields of a record arrays of the exact type only.
    """

    def __init__(self, names: set[str]) -> None:
        self.names = names

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Replace the target of an assignment."""
        mine = isinstance(node.value, ast.Name) and node.value.id == "self" and node.attr in self.names
        if not mine or not isinstance(node.ctx, ast.Store):
            return node
        field = ast.Attribute(node.value, node.attr, ast.Load())
        return ast.copy_location(ast.Subscript(field, ast.Constant(...), ast.Store()), node)


def _with_array_stores(function: Any, record: Record) -> Any:
    """Return a method with its assignments to array fields written out; lines keep their numbers."""
    names = {item.name for item in record.fields if item.shape}
    if not names & set(function.__code__.co_names):
        return function
    source, line = inspect.getsourcelines(function)
    tree = ast.increment_lineno(ast.parse(textwrap.dedent("".join(source))), line - 1)
    tree = ast.fix_missing_locations(_ArrayStores(names).visit(tree))
    flags = function.__code__.co_flags & annotations.compiler_flag
    code = compile(tree, function.__code__.co_filename, "exec", flags, dont_inherit=True)
    namespace: dict[str, Any] = {}
    exec(code, function.__globals__, namespace)
    return namespace[function.__name__]


def _wrapper(arguments: Sequence[Slot], targets: Sequence[Slot]) -> str:
    """Return the source of the function of pointers; its text is made of kinds and shapes alone."""
    names = [f"p{index}" for index in range(len(arguments) + len(targets))]
    results = [f"r{index}" for index in range(len(targets))]
    reads = ", ".join(
        (f"carray({name}, {slot.shape})" if slot.shape else f"{name}[0]")
        + (" != 0" if slot.scalar == "bool" else "")
        for name, slot in zip(names, arguments, strict=False)
    )
    lines = [f"def call({', '.join(['record', *names])}):", "    self = carray(record, 1)[0]"]
    lines.append(f"    {', '.join(results)}{' = ' if results else ''}body(self, {reads})")
    for result, name, slot in zip(results, names[len(arguments) :], targets, strict=True):
        target = f"carray({name}, {slot.shape})[...]" if slot.shape else f"{name}[0]"
        lines.append(f"    {target} = {result}")
    return "\n".join(lines)
