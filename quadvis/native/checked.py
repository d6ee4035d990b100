"""Mathematics for compiled methods that refuses what Python's own refuses.

numba's `math.sqrt(-1.0)` is NaN and its `int(nan)` some number; Python raises an exception for both. A
compiled method that meets such a value fails, and the interpreter repeats the call: it raises the exception,
or has the right result where Python has one, as for `int(1e300)`. So the functions here may refuse a little
more than Python does, never less.
"""

from __future__ import annotations

import functools
import math
import types
from collections.abc import Callable
from typing import Any

WHOLE = 2.0**63  # from here on, no 64-bit integer has the value
ONE = (
    "sqrt", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "sin", "cos", "tan", "asin", "acos",
    "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "gamma", "lgamma",
)  # fmt: skip
TWO = ("pow", "fmod", "remainder", "hypot", "ldexp")
TO_WHOLE = ("floor", "ceil", "trunc")


@functools.cache
def replacements() -> dict[Any, Any]:
    """Return, for a function or module that a method may name, the one that compiled code takes instead."""
    found: dict[Any, Any] = {int: _whole(int), round: _rounded(), pow: power()}
    for names, checked in ((ONE, _one), (TWO, _two), (TO_WHOLE, _whole)):
        found |= {getattr(math, name): checked(getattr(math, name)) for name in names if hasattr(math, name)}
    module = types.ModuleType("math")
    module.__dict__.update({name: _replaced(value, found) for name, value in vars(math).items()})
    return {**found, math: module}


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
    """Return the function that compiled code calls for `x ** y`."""
    from numba import types as kinds
    from numba.extending import overload

    def raised(x: Any, y: Any) -> Any:
        return x**y

    def scalar(x: Any, y: Any) -> Any:
        if x < 0 and y != math.floor(y):
            raise ValueError  # a complex number in Python
        if x == 0 and y < 0:
            raise ZeroDivisionError
        result = math.pow(x, y)
        if math.isinf(result) and math.isfinite(x) and math.isfinite(y):
            raise OverflowError
        return result

    def whole(x: Any, y: Any) -> Any:
        if y < 0:
            raise ValueError  # a float in Python
        return x**y

    @overload(raised)
    def _(x: Any, y: Any) -> Any:
        if isinstance(x, kinds.Array) or isinstance(y, kinds.Array):
            return lambda x, y: x**y
        return whole if isinstance(x, kinds.Integer) and isinstance(y, kinds.Integer) else scalar

    return raised
