"""Mathematics for compiled methods that refuses what Python's own refuses.

numba's `math.sqrt(-1.0)` is NaN and its `int(nan)` some number; Python raises an exception for both. A
compiled method that meets such a value fails, and the interpreter repeats the call: it raises the exception,
or has the right result where Python has one, as for `int(1e300)`. So the functions here may refuse a little
more than Python does, never less. And they have Python's bits: powers are the C library's, which numba and
LLVM would replace by multiplications, and functions that Python computes in its own way are not known here.
"""

from __future__ import annotations

import functools
import math
import types
from collections.abc import Callable
from typing import Any

from quadvis.native.arrays import KnownPart, OtherBits, instead_of_numpys

WHOLE = 2.0**63  # from here on, no 64-bit integer has the value
ONE = (
    "sqrt", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "sin", "cos", "tan", "asin", "acos",
    "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
)  # fmt: skip
TWO = ("fmod", "remainder", "ldexp")
PYTHONS = ("hypot", "dist", "fsum", "sumprod", "gamma", "lgamma")  # its own, not the C library's
TO_WHOLE = ("floor", "ceil", "trunc")


@functools.cache
def replacements() -> dict[Any, Any]:
    """Return, for a function or module that a method may name, the one that compiled code takes instead."""
    found: dict[Any, Any] = {int: _whole(int), round: _rounded(), pow: power(), math.pow: _two(_raised())}
    for names, checked in ((ONE, _one), (TWO, _two), (TO_WHOLE, _whole)):
        found |= {getattr(math, name): checked(getattr(math, name)) for name in names if hasattr(math, name)}
    named = {name: _replaced(value, found) for name, value in vars(math).items() if name not in PYTHONS}
    return {**found, math: KnownPart(math, named)}


def instead(value: Any) -> Any:
    """Return what compiled code takes for a global of a method: the value itself, or what stands for it.

    OtherBits if it is a function that compiled code does not have.
    """
    if isinstance(value, types.BuiltinFunctionType) and value in _pythons():
        raise OtherBits(f"{value.__module__}.{value.__name__}")
    if isinstance(value, types.ModuleType | types.BuiltinFunctionType | type) and value in replacements():
        return replacements()[value]
    return instead_of_numpys(value)


@functools.cache
def _pythons() -> frozenset[Any]:
    return frozenset(getattr(math, name) for name in PYTHONS if hasattr(math, name))


def _replaced(value: Any, found: dict[Any, Any]) -> Any:
    return found.get(value, value) if callable(value) else value


def _jit(function: Callable[..., Any]) -> Any:
    import numba

    return numba.njit(function, error_model="python")


def _one(function: Any) -> Any:
    def checked(x: float) -> Any:
        result = function(x)
        if (math.isnan(result) and not math.isnan(x)) or (math.isinf(result) and math.isfinite(x)):
            raise ValueError
        return result

    return _jit(checked)


def _two(function: Any) -> Any:
    def checked(x: float, y: float) -> Any:
        result = function(x, y)
        if math.isnan(result) and not (math.isnan(x) or math.isnan(y)):
            raise ValueError
        if math.isinf(result) and math.isfinite(x) and math.isfinite(y):
            raise ValueError
        return result

    return _jit(checked)


def _whole(function: Any) -> Any:
    def checked(x: Any) -> Any:
        if not -WHOLE < x < WHOLE:
            raise ValueError
        return function(x)

    return _jit(checked)


def _rounded() -> Any:
    def checked(x: float) -> int:
        if not -WHOLE < x < WHOLE:
            raise ValueError
        return round(x)

    return _jit(checked)


@functools.cache
def power() -> Any:
    """Return the function that compiled code calls for `x ** y`; not for arrays: numpy has its own ways."""
    from numba import types as kinds
    from numba.extending import overload

    libm = _raised()

    def raised(x: Any, y: Any) -> Any:
        return x**y

    def scalar(x: Any, y: Any) -> Any:
        if x < 0 and y != math.floor(y):
            raise ValueError  # a complex number in Python
        if x == 0 and y < 0:
            raise ZeroDivisionError
        result = libm(x, y)
        if math.isinf(result) and math.isfinite(x) and math.isfinite(y):
            raise OverflowError
        return result

    def whole(x: Any, y: Any) -> Any:
        if y < 0:
            raise ValueError  # a float in Python
        return x**y

    @overload(raised, strict=False)
    def _(x: Any, y: Any) -> Any:
        if not all(isinstance(kind, kinds.Float | kinds.Integer | kinds.Boolean) for kind in (x, y)):
            return None
        return whole if isinstance(x, kinds.Integer) and isinstance(y, kinds.Integer) else scalar

    return raised


@functools.cache
def _raised() -> Any:
    """Return `pow` of the C library, which is what Python calls.

    numba multiplies where the exponent is a whole number, and LLVM knows better ways for 2.0, 0.5 and others:
    a quarter of all cubes have another last bit then. LLVM leaves a call alone that is no "builtin".
    """
    from llvmlite import ir
    from numba import types as kinds
    from numba.extending import intrinsic

    @intrinsic
    def called(_: Any, x: Any, y: Any) -> Any:
        def emit(_: Any, builder: Any, __: Any, values: Any) -> Any:
            real = ir.DoubleType()
            function = builder.module.globals.get("pow")
            if function is None:
                function = ir.Function(builder.module, ir.FunctionType(real, [real, real]), "pow")
                function.attributes.add("nobuiltin")
            return builder.call(function, values)

        return kinds.float64(kinds.float64, kinds.float64), emit

    libm: Any = called
    return _jit(lambda x, y: libm(float(x), float(y)))
