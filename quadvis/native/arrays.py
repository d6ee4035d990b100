"""numpy for compiled methods: the part of it that has the same bits as interpreted.

numpy adds in pairs, and calls BLAS and code for the vectors of each processor; machine code adds in turn and
calls the C library. So compiled methods know the functions of numpy that are exact or only move values, and
have `ours` in the place of some others. A method that names another one stays interpreted.

Where the sign of a zero or the bits of a NaN decide, ours fail, and the interpreter repeats the call.
"""

from __future__ import annotations

import functools
import math
import types
from collections.abc import Callable
from typing import Any

import numpy as np

EXACT = (
    "pi", "e", "inf", "nan", "newaxis", "bool_", "int8", "int16", "int32", "int64", "uint8", "uint16",
    "uint32", "uint64", "intp", "float32", "float64", "array", "asarray", "ascontiguousarray", "zeros",
    "ones", "empty", "full", "zeros_like", "ones_like", "empty_like", "full_like", "eye", "identity",
    "concatenate", "stack", "hstack", "vstack", "column_stack", "reshape", "ravel", "transpose",
    "expand_dims", "atleast_1d", "atleast_2d", "roll", "flip", "repeat", "broadcast_to", "meshgrid",
    "diag", "ndim", "shape", "size", "copy", "where", "flatnonzero", "nonzero", "count_nonzero",
    "searchsorted", "sort", "argsort", "argmin", "argmax", "any", "all", "array_equal", "isnan",
    "isinf", "isfinite", "signbit", "add", "subtract", "multiply", "divide", "true_divide", "negative",
    "absolute", "abs", "fabs", "sqrt", "square", "floor", "ceil", "trunc", "rint", "copysign", "equal",
    "not_equal", "less", "less_equal", "greater", "greater_equal", "logical_and", "logical_or",
    "logical_not", "logical_xor", "bitwise_and", "bitwise_or", "bitwise_xor", "invert", "diff", "outer",
    "cross",
)  # fmt: skip
METHODS = frozenset((
    "sum", "mean", "min", "max", "prod", "std", "var", "ptp", "trace", "dot", "clip", "round", "cumsum",
    "cumprod",
))  # fmt: skip
FUNCTIONS = (np.ufunc, type(np.sum), types.BuiltinFunctionType)  # what a function of numpy can be
LANES, BLOCK = 8, 128  # of numpy's sum: sums side by side, and how many numbers it adds that way at most


class OtherBits(NotImplementedError, AttributeError):
    """Compiled, a function would have other bits than interpreted; so the method stays interpreted."""

    def __init__(self, name: str) -> None:
        super().__init__(f"'{name}' would have other bits than interpreted")


class KnownPart(types.ModuleType):
    """A module with the names that compiled code may use; OtherBits for all others."""

    def __init__(self, module: types.ModuleType, names: dict[str, Any]) -> None:
        super().__init__(module.__name__)
        self.__dict__.update(names)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        raise OtherBits(f"{self.__name__}.{name}")


@functools.cache
def ours() -> dict[str, Any]:
    """Return our functions by the names that they have in numpy."""
    total, small, great = _total(), _extreme(True), _extreme(False)
    return {
        "sum": total, "mean": _mean(total), "min": small, "amin": small, "max": great, "amax": great,
        "minimum": _chosen(True), "maximum": _chosen(False), "sign": _sign(), "arange": _arange(),
    }  # fmt: skip


@functools.cache
def numpys() -> KnownPart:
    """Return what stands for the module numpy in compiled code."""
    return KnownPart(np, {name: getattr(np, name) for name in EXACT} | ours())


@functools.cache
def methods() -> dict[str, Any]:
    """Return what compiled code calls for methods of arrays whose bits the order of elements decides."""
    return {name: ours()[name] for name in METHODS if name in ours()}


@functools.cache
def _known() -> dict[Any, Any]:
    named = {name: getattr(np, name) for name in (*EXACT, *ours())}
    return {each: getattr(numpys(), name) for name, each in named.items() if isinstance(each, FUNCTIONS)}


def instead_of_numpys(value: Any) -> Any:
    """Return what compiled code takes for a global: the value itself, but not for numpy and its functions.

    OtherBits if it is a function of numpy that compiled code does not have.
    """
    if value is np:
        return numpys()
    if isinstance(value, types.ModuleType) and value.__name__.startswith("numpy."):
        return KnownPart(value, {})
    if not isinstance(value, FUNCTIONS) or not f"{getattr(value, '__module__', '')}".startswith("numpy"):
        return value
    if value not in _known():
        raise OtherBits(f"numpy.{value.__name__}")
    return _known()[value]


def _overload(function: Any) -> Callable[[Any], Any]:
    from numba.extending import overload

    return overload(function, strict=False)


def _has(kind: Any, *scalars: str) -> bool:
    """Return whether a type of numba is an array of such scalars."""
    from numba import types as kinds

    return isinstance(kind, kinds.Array) and isinstance(kind.dtype, tuple(getattr(kinds, s) for s in scalars))


def _is_row(kind: Any) -> bool:
    return _has(kind, "Float") and kind.ndim == 1 and kind.dtype.bitwidth == 64


def _total() -> Any:
    def total(x: Any) -> Any:
        return x.sum()

    @_overload(total)
    def _(x: Any) -> Any:
        if not _is_row(x) and not _has(x, "Integer", "Boolean"):
            raise OtherBits("sum")
        return summed if _is_row(x) else lambda x: x.sum()

    return total


def summed(x: Any) -> float:
    """Return the sum of numbers (n,) in numpy's order: `pairwise_sum` of its loops_utils.h.

    ValueError where numpy goes another way: by halves, or backwards.
    """
    count = len(x)
    if count > BLOCK or x.strides[0] < 0:
        raise ValueError
    total, begun = -0.0, 0
    if count >= LANES:
        begun = count - count % LANES
        a, b, c, d, e, f, g, h = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]
        for index in range(LANES, begun, LANES):
            a += x[index]
            b += x[index + 1]
            c += x[index + 2]
            d += x[index + 3]
            e += x[index + 4]
            f += x[index + 5]
            g += x[index + 6]
            h += x[index + 7]
        total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for index in range(begun, count):
        total += x[index]
    return 0.0 + total


def _mean(total: Any) -> Any:
    def mean(x: Any) -> Any:
        return x.mean()

    @_overload(mean)
    def _(x: Any) -> Any:
        if not _is_row(x):
            raise OtherBits("mean")
        return lambda x: total(x) / len(x)

    return mean


def _extreme(least: bool) -> Any:
    """Return the least, or greatest, of all elements; it fails where NaN or the sign of a zero decides."""

    def extreme(x: Any) -> Any:
        return x.min() if least else x.max()

    def found(x: Any) -> Any:
        best, zeros, signs = math.inf if least else -math.inf, 0, 0
        for value in x.flat:
            if math.isnan(value):
                raise ValueError
            best = value if value != best and (value < best) == least else best
            zeros += 1 if value == 0.0 else 0
            signs += 1 if value == 0.0 and math.copysign(1.0, value) < 0.0 else 0
        if x.size == 0 or (best == 0.0 and 0 < signs < zeros):
            raise ValueError
        return best

    @_overload(extreme)
    def _(x: Any) -> Any:
        if not _has(x, "Float", "Integer", "Boolean"):
            raise OtherBits("min" if least else "max")
        whole = (lambda x: x.min()) if least else (lambda x: x.max())
        return found if _has(x, "Float") else whole

    return extreme


def _chosen(least: bool) -> Any:
    """Return `numpy.minimum` or `numpy.maximum`; it fails where 0.0 meets -0.0: processors differ there."""

    def choose(x: Any, y: Any) -> Any:
        return np.minimum(x, y) if least else np.maximum(x, y)

    def chosen(x: Any, y: Any) -> Any:
        return x if math.isnan(x) or ((x < y) == least and not math.isnan(y)) else y

    def tied(x: Any, y: Any) -> bool:
        return x == 0 and y == 0 and math.copysign(1.0, x) != math.copysign(1.0, y)

    one, tie = _vectorized(chosen), _vectorized(tied)

    def checked(x: Any, y: Any) -> Any:
        if np.any(tie(x, y)):
            raise ValueError
        return one(x, y)

    _overload(choose)(lambda x, y: checked)
    return choose


def _sign() -> Any:
    """Return `numpy.sign`, of floats only; numba's keeps -0.0."""
    one = _vectorized(lambda x: x if math.isnan(x) else 1.0 if x > 0 else -1.0 if x < 0 else 0.0)

    def sign(x: Any) -> Any:
        return np.sign(x)

    @_overload(sign)
    def _(x: Any) -> Any:
        from numba import types as kinds

        if not isinstance(getattr(x, "dtype", x), kinds.Float):
            raise OtherBits("numpy.sign")
        return lambda x: one(x)

    return sign


def _vectorized(function: Any) -> Any:
    import numba

    made: Any = numba.vectorize  # cannot raise exceptions
    return made(function)


@functools.cache
def other_shape() -> Any:
    """Return what compiled code calls where a slice is given an array of another shape.

    numba's own puts both shapes into a sentence; what makes texts of numbers takes it seconds to compile.
    """

    def refuse(given: Any, taken: Any) -> None:
        raise ValueError

    @_overload(refuse)
    def _(given: Any, taken: Any) -> Any:
        def refused(given: Any, taken: Any) -> None:
            raise ValueError("an array of another shape is assigned to a slice")

        return refused

    return refuse


def _arange() -> Any:
    """Return numpy's range, of whole numbers only: others are rounded in two ways."""

    def arange(start: Any, stop: Any = None, step: Any = None) -> Any:
        return np.arange(start, stop, step)

    @_overload(arange)
    def _(start: Any, stop: Any = None, step: Any = None) -> Any:
        from numba import types as kinds

        if any(isinstance(each, kinds.Float) for each in (start, stop, step)):
            raise OtherBits("numpy.arange")
        return lambda start, stop=None, step=None: np.arange(start, stop, step)

    return arange
