"""Block types compiled by numba, from the source of their interpreted methods and for the same memory."""

from __future__ import annotations

import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from quadvis.block.interface import CROSSING
from quadvis.engine.memory import packed
from quadvis.machine.garbage import uncollected
from quadvis.native.arrays import METHODS, OtherBits, methods, other_shape
from quadvis.native.block_type import BlockType, Kind, MethodType
from quadvis.native.cache import MachineCode
from quadvis.native.checked import instead, power, replacements
from quadvis.native.foreign import intrinsics
from quadvis.native.functions import LOOPS, ArrayKind, NativeFunction
from quadvis.native.machine_code import Compiled, Unlinkable, emit
from quadvis.native.routine import ROUTINE, Routine, plain
from quadvis.native.source import METHOD, POWER, Unreadable, fingerprint, names_in, prepared

REFUSE = "raise_with_shape_context"  # of numba's arrayobj
# A division by zero and a wrong index are noticed. Nobody calls the functions from Python.
OPTIONS = {"error_model": "python", "boundscheck": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def compile_block(kind: BlockType, prefix: str) -> MachineCode:
    """Compile all methods of a block type; the functions' names begin with ``prefix``.

    Code that has a ``refusal`` if numba cannot compile one of them; it names the method.
    """
    import numba

    compiled: dict[str, Compiled] = {}
    try:
        for name, function in compiled_methods(kind):
            compiled[name] = function
        return machine_code(compiled, prefix)
    except (Unreadable, Unlinkable, NotImplementedError, numba.core.errors.NumbaError) as error:
        failed = next((method.name for method in kind.methods if method.name not in compiled), "")
        return _refused(f"method '{failed}'" if failed else "", error)


def _refused(where: str, error: Exception) -> MachineCode:
    """Return code that there is not; a source that cannot be read now may be there the next time."""
    reason = f"{where}: {_cause(error)}" if where else str(error)
    return MachineCode(refusal=reason, passing=isinstance(error, Unreadable))


def compiled_methods(kind: BlockType) -> Iterator[tuple[str, Compiled]]:
    """Yield the methods of a block type, compiled one after the other; an exception if one cannot be."""
    import numba

    scope = _Scope({field.name for field in kind.record.fields if field.shape})
    pointer: Callable[[Any], Any] = numba.types.CPointer
    for method in kind.methods:
        body = scope.jit(kind.function(method.name))
        pointers = [
            pointer(numba.from_dtype(kind.record.dtype)),
            *(pointer(_pointed(each)) for each in (*method.arguments, *method.results)),
        ]
        try:
            compiled = compile_function(_wrapper(method, body), pointers)
        except KeyError as error:  # numba's, for what is no field of the record
            if not hasattr(kind.block, str(error.args[0])):
                raise
            remedy = "which only Python can; call a plain function that takes self"
            raise NotImplementedError(f"it calls self.{error.args[0]}, {remedy}") from error
        yield method.name, compiled


def compile_functions(functions: Sequence[NativeFunction], prefix: str) -> MachineCode:
    """Compile plain functions; code that has a ``refusal``, with its function, if numba cannot."""
    import numba

    scope, pointer = _Scope(set()), vars(numba.types)["CPointer"]
    compiled: dict[str, Compiled] = {}
    try:
        for function in functions:
            scalars = ["int64", *(kind.scalar for kind in (*function.takes, *function.gives))]
            body = scope.jit(function.function)
            compiled[function.__name__] = compile_function(
                _entry(function, body), [pointer(getattr(numba.types, scalar)) for scalar in scalars]
            )
        return machine_code(compiled, prefix)
    except (Unreadable, Unlinkable, NotImplementedError, numba.core.errors.NumbaError) as error:
        failed = next((each.__name__ for each in functions if each.__name__ not in compiled), "")
        return _refused(f"function '{failed}'" if failed else "", error)


def _entry(function: NativeFunction, body: Any) -> Any:
    """Return the function of pointers that calls a plain function; the first has the sizes of the letters."""
    import numba

    def read(name: str, kind: ArrayKind) -> str:
        parts = [
            f"sizes[{function.letters.index(part)}]" if isinstance(part, str) else str(part)
            for part in kind.shape
        ]
        return f"carray({name}, ({', '.join(parts)},))" if parts else f"{name}[0]"

    takes = [f"p{index}" for index in range(len(function.takes))]
    gives = [f"r{index}" for index in range(len(function.gives))]
    reads = ", ".join(map(read, takes, function.takes))
    found = [f"f{index}" for index in range(len(gives))]
    lines = [f"def call({', '.join(['sizes', *takes, *gives])}):", f"    {', '.join(found)} = body({reads})"]
    for value, name, kind in zip(found, gives, function.gives, strict=True):
        lines.append(f"    {read(name, kind)}{'[...]' if kind.shape else ''} = {value}")
    namespace: dict[str, Any] = {"carray": vars(numba)["carray"], "body": body}
    exec("\n".join(lines), namespace)
    return namespace["call"]


def _cause(error: Exception) -> str:
    """Return the first line of a message that says something; files may have changed when it is read."""
    lines = [line for line in str(error).splitlines() if line.strip() and not line.startswith("Failed in ")]
    return lines[0].strip() if lines else type(error).__name__


def machine_code(compiled: Mapping[str, Compiled], prefix: str) -> MachineCode:
    """Return the object file of functions, which are named after the prefix there."""
    names = {name: f"{prefix}_{name}" for name in compiled}
    content, fallible = emit({names[name]: function for name, function in compiled.items()})
    return MachineCode(content, names, frozenset(name for name in names if names[name] in fallible))


def compile_routine(routine: Routine, prefix: str) -> MachineCode:
    """Compile a routine with the plain functions that it calls."""
    import numba

    kinds: Any = {"w": numba.int64, "r": numba.float64}
    pointer: Callable[[Any], Any] = numba.types.CPointer
    pointers = [pointer(kinds[kind]) for kind in routine.pointers]
    replaced: Mapping[Any, Any] = {**intrinsics(), **routine.instead}
    options = {**OPTIONS, "error_model": "numpy", "boundscheck": False}
    known: dict[types.FunctionType, Any] = {}

    def scoped(function: types.FunctionType) -> types.FunctionType:
        scope = dict(function.__globals__)
        for name in set(names_in(function.__code__)) & scope.keys():
            value = scope[name]
            if isinstance(value, types.FunctionType):
                taken = replaced.get(value, value)
                scope[name] = jitted(taken) if isinstance(taken, types.FunctionType) else taken
        return types.FunctionType(function.__code__, scope, function.__name__)

    def jitted(function: types.FunctionType) -> Any:
        if function not in known:
            jit: Any = numba.njit
            known[function] = jit(scoped(function), error_model="numpy")
        return known[function]

    compiled = compile_function(scoped(plain(routine.function)), pointers, options)
    return machine_code({ROUTINE: compiled}, prefix)


def compile_function(
    function: Any, pointers: Sequence[Any], options: Mapping[str, Any] = OPTIONS
) -> Compiled:
    """Compile a function of pointers (types of numba) that returns nothing."""
    import numba

    jit: Any = numba.njit
    with uncollected(), _quickly():
        made = jit(numba.void(*pointers), **options)(function)
    result = made.overloads[made.signatures[0]]
    return Compiled(result.library.get_llvm_str(), result.fndesc.llvm_func_name, len(pointers))


@contextmanager
def _quickly() -> Iterator[None]:
    """Have numba optimise at its second level, a quarter sooner than at its third; `emit` comes after it.

    And have it compile no texts for a slice that is given an array of another shape.
    """
    from numba.core import config as settings
    from numba.core import registry
    from numba.np import arrayobj

    config: Any = settings
    _ = registry.cpu_target.target_context  # what numba makes for the whole process stays as it was
    level, refuse = config.OPT, getattr(arrayobj, REFUSE, None)
    config.OPT = type(level)(2)
    if refuse:  # older releases have no such sentence
        setattr(arrayobj, REFUSE, other_shape())
    try:
        yield
    finally:
        config.OPT = level
        if refuse:
            setattr(arrayobj, REFUSE, refuse)


Known = dict[tuple[types.FunctionType, str], Any]  # numba's dispatchers, by function and fingerprint
_shared: Known = {}


class _Scope:
    """Functions compiled with their helpers; each helper once. ``arrays`` are the array fields of `self`.

    Helpers that never get `self` are the same for all block types.
    """

    def __init__(self, arrays: set[str]) -> None:
        self._arrays = arrays
        self._known: Known = {}

    def jit(self, function: types.FunctionType) -> Any:
        """Return numba's dispatcher for a plain function and the plain functions that it calls."""
        function = getattr(function, LOOPS, function)
        known, key = self._known, (function, "")
        if not _meets_self(function, set()):
            known, key = _shared, (function, fingerprint(function))
        if key not in known:
            import numba

            checked = replacements()
            scope = dict(function.__globals__)
            scope |= {"int": checked[int], "round": checked[round], "pow": checked[pow], POWER: power()}
            scope |= {METHOD.format(name): value for name, value in methods().items()}
            copy = prepared(function, self._arrays, scope)
            for name in METHODS - methods().keys():
                if METHOD.format(name) in names_in(copy.__code__):
                    raise OtherBits(name)
            jit: Any = numba.njit
            known[key] = jit(copy, **OPTIONS)
            for name in names_in(function.__code__):
                value = function.__globals__.get(name)
                if isinstance(value, types.FunctionType):
                    scope[name] = self.jit(value)
                elif name in function.__globals__:
                    scope[name] = instead(value)
        return known[key]


def _meets_self(function: types.FunctionType, seen: set[types.FunctionType]) -> bool:
    """Return whether a function, or one that it calls, has a `self`."""
    if function in seen:
        return False
    seen.add(function)
    code = function.__code__
    called = (function.__globals__.get(name) for name in names_in(code))
    return "self" in (*code.co_varnames, *code.co_freevars) or any(
        _meets_self(each, seen) for each in called if isinstance(each, types.FunctionType)
    )


# What a ``crossing`` returns, value by value.
CROSSED = """\
    found, place = asarray({}), 0
    if found.size != {size}[0]:
        raise ValueError
    for value in found.flat:
        {values}[place] = value
        place += 1"""


def _pointed(kind: Kind) -> Any:
    """Return numba's type for the target of a pointer; numba cannot store through pointers to bool."""
    import numba

    scalar, shape = kind
    return numba.uint8 if scalar == "bool" and not shape else numba.from_dtype(packed(scalar, shape))


def _wrapper(method: MethodType, body: Any) -> Any:
    """Return the function of pointers that calls a method; its text is made of kinds and shapes alone."""
    import numba

    count = len(method.arguments)
    names = [f"p{index}" for index in range(count + len(method.results))]
    results = [f"r{index}" for index in range(len(method.results))]
    reads = ", ".join(
        (f"carray({name}, {shape})" if shape else f"{name}[0]") + (" != 0" if scalar == "bool" else "")
        for name, (scalar, shape) in zip(names, method.arguments, strict=False)
    )
    lines = [f"def call({', '.join(['record', *names])}):", "    self = carray(record, 1)[0]"]
    if method.name == CROSSING:
        size, values = names[count:]
        lines += CROSSED.format(f"body(self, {reads})", size=size, values=values).splitlines()
        results = []
    else:
        lines.append(f"    {', '.join(results)}{' = ' if results else ''}body(self, {reads})")
    for result, name, (_, shape) in zip(results, names[count:], method.results, strict=bool(results)):
        target = f"carray({name}, {shape})[...]" if shape else f"{name}[0]"
        lines.append(f"    {target} = {result}")
    namespace: dict[str, Any] = {"carray": vars(numba)["carray"], "body": body, "asarray": np.asarray}
    exec("\n".join(lines), namespace)
    return namespace["call"]
