"""The Python source of a method as compiled code takes it, and a hash of everything that it depends on."""

from __future__ import annotations

import ast
import builtins
import enum
import functools
import hashlib
import inspect
import types
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from quadvis.native.arrays import METHODS
from quadvis.native.functions import LOOPS

POWER, METHOD = "__power__", "__array_{}__"
PLAIN = (int, float, complex, str, bytes, bool, type(None), type(...), frozenset, range, np.generic)


class Unreadable(Exception):
    """The source of a method is not there, or is no longer that of the method."""


def names_in(code: types.CodeType) -> Iterator[str]:
    """Yield the names of globals and attributes in a function and in what is nested in it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from names_in(constant)


def prepared(function: types.FunctionType, arrays: Collection[str], scope: dict[str, Any]) -> Any:
    """Return a function again, with its globals in ``scope`` and three things written out for numba.

    ``self.last = value`` becomes ``self.last[...] = value`` where ``last`` is one of ``arrays``: interpreted,
    the two are the same, but numba gives the fields of a record arrays of the exact type only. ``x ** y``
    becomes a call, since numba's power refuses less than Python's and has other bits. So does ``x.sum()``,
    and what else numba adds up or chooses in another order. Lines keep their numbers. Unreadable if the file
    was edited after the function was made.
    """
    rewriting = _Rewriting(arrays, {name for name in scope if isinstance(scope[name], types.ModuleType)})
    code = function.__code__
    if rewriting.concerns(function):
        code = _rewritten(function, rewriting)
    copy = types.FunctionType(code, scope, function.__name__, function.__defaults__, function.__closure__)
    copy.__kwdefaults__ = function.__kwdefaults__
    return copy


class _Rewriting(ast.NodeTransformer):
    """Writes out stores to arrays, powers, and methods of arrays."""

    def __init__(self, arrays: Collection[str], modules: Collection[str]) -> None:
        self.arrays, self.modules = frozenset(arrays), frozenset(modules)

    def concerns(self, function: types.FunctionType) -> bool:
        """Return whether anything may have to be written out."""
        if (self.arrays | METHODS) & set(names_in(function.__code__)):
            return True
        try:
            return "**" in inspect.getsource(function)
        except (OSError, TypeError):
            return False

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Replace the target of an assignment."""
        mine = isinstance(node.value, ast.Name) and node.value.id == "self" and node.attr in self.arrays
        if not mine or not isinstance(node.ctx, ast.Store):
            return node
        field = ast.Attribute(node.value, node.attr, ast.Load())
        return ast.copy_location(ast.Subscript(field, ast.Constant(...), ast.Store()), node)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Replace a method of an array by a function."""
        self.generic_visit(node)
        method = node.func
        if not isinstance(method, ast.Attribute) or method.attr not in METHODS:
            return node
        if isinstance(method.value, ast.Name) and method.value.id in self.modules:
            return node
        called = ast.Name(METHOD.format(method.attr), ast.Load())
        return ast.copy_location(ast.Call(called, [method.value, *node.args], node.keywords), node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        """Replace a power by a call."""
        self.generic_visit(node)
        if not isinstance(node.op, ast.Pow):
            return node
        called = ast.Call(ast.Name(POWER, ast.Load()), [node.left, node.right], [])
        return ast.copy_location(called, node)


def _rewritten(function: types.FunctionType, rewriting: _Rewriting) -> types.CodeType:
    """Return the new code of a function, compiled with its whole file, since imports decide over code."""
    code = function.__code__
    try:
        text = "".join(inspect.findsource(function)[0])
        tree = ast.parse(text)
    except (OSError, SyntaxError, IndexError) as error:
        raise Unreadable(str(error)) from error
    now = _compiled(tree, code)
    if now is None or _text(now) != _text(code):
        raise Unreadable("the file was edited after the block was loaded")
    made = _compiled(ast.fix_missing_locations(rewriting.visit(tree)), code)
    assert made is not None, "rewriting keeps lines"
    return made


def _compiled(tree: ast.Module, code: types.CodeType) -> types.CodeType | None:
    """Compile a file; return the code that stands where ``code`` stood in it."""
    module = compile(tree, code.co_filename, "exec", dont_inherit=True)
    place = (code.co_name, code.co_firstlineno)
    return next((each for each in _nested(module) if (each.co_name, each.co_firstlineno) == place), None)


def _nested(code: types.CodeType) -> Iterator[types.CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield constant
            yield from _nested(constant)


def fingerprint(*functions: types.FunctionType) -> str:
    """Return a SHA-256 of the functions and of every function, constant and version that they reach."""
    parts: list[str] = []
    seen: dict[int, int] = {}
    for function in functions:
        _describe(function, (), parts, seen)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _describe(value: Any, names: Collection[str], parts: list[str], seen: dict[int, int]) -> None:
    """Add what a value is; ``names`` are those of a module's members that are used."""
    if isinstance(value, PLAIN):
        parts.append(_constant(value))
    elif isinstance(value, tuple):
        parts.append(f"{type(value).__name__} of {len(value)}")
        for item in value:
            _describe(item, names, parts, seen)
    elif isinstance(value, enum.EnumMeta):
        members: dict[str, Any] = dict(value.__members__)
        parts.append(repr([(name, member.value) for name, member in members.items()]))
    elif isinstance(value, type) and issubclass(value, tuple):  # fields of a named tuple have places
        fields = getattr(value, "_fields", ())
        parts.append(f"{value.__qualname__} {fields} {getattr(value, '_field_defaults', {})}")
    elif isinstance(value, np.ndarray):
        parts.append(f"{value.dtype}{value.shape}{value.tobytes().hex()}")
    elif isinstance(value, types.ModuleType):
        parts.append(f"{value.__name__} {getattr(value, '__version__', '')}")
        if value is not builtins and not value.__name__.startswith(("numpy", "math")):
            _describe_all(
                {name: vars(value)[name] for name in names if name in vars(value)}, names, parts, seen
            )
    elif id(value) in seen:
        parts.append(f"again {seen[id(value)]}")
    elif isinstance(value, types.FunctionType):
        seen[id(value)] = len(seen)
        used = _used(value.__code__)
        parts.append(_text(value.__code__))
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        for constant in (value.__defaults__, value.__kwdefaults__, *cells):
            _describe(constant, used, parts, seen)
        _describe(getattr(value, LOOPS, None), used, parts, seen)
        known = value.__globals__
        _describe_all({name: known[name] for name in used if name in known}, used, parts, seen)
    elif isinstance(plain := getattr(value, "py_func", None), types.FunctionType):  # compiled by its author
        _describe(plain, names, parts, seen)
    else:
        parts.append(f"{type(value).__name__} {getattr(value, '__qualname__', '') or repr(value)}")


def _describe_all(
    values: dict[str, Any], names: Collection[str], parts: list[str], seen: dict[int, int]
) -> None:
    for name, value in values.items():
        parts.append(name)
        _describe(value, names, parts, seen)


@functools.cache
def _used(code: types.CodeType) -> tuple[str, ...]:
    return tuple(sorted(set(names_in(code))))


@functools.cache
def _text(code: types.CodeType) -> str:
    """Return all that a code object does, without lines and files."""
    constants = list(map(_constant, code.co_consts))
    return repr((
        code.co_name, code.co_code.hex(), code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars,
        code.co_argcount, code.co_kwonlyargcount, code.co_flags, constants,
    ))  # fmt: skip


def _constant(value: Any) -> str:
    if isinstance(value, types.CodeType):
        return _text(value)
    # The order of a set's members differs from process to process.
    return repr(sorted(map(repr, value))) if isinstance(value, frozenset) else repr(value)
