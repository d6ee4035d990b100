"""A mathematical function of a signal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._rounding import CEIL, FIX, FLOOR, NEAREST, rounded

FUNCTIONS = (
    "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "log10",
    "abs", "sign", "square", "sqrt", "reciprocal", "floor", "ceil", "round", "fix",
)  # fmt: skip
(
    SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, EXP, LOG, LOG10,
    ABS, SIGN, SQUARE, SQRT, RECIPROCAL, DOWN, UP, ROUND, TO_ZERO,
) = range(len(FUNCTIONS))  # fmt: skip
# The units of input and output, where they are not those of plain numbers.
UNITS = {
    "sin": ("rad", "1"), "cos": ("rad", "1"), "tan": ("rad", "1"),
    "asin": ("1", "rad"), "acos": ("1", "rad"), "atan": ("1", "rad"),
    "abs": ("a", "a"), "sign": ("a", "1"), "square": ("a", "a^2"), "sqrt": ("a", "a^0.5"),
    "reciprocal": ("a", "1/a"), "floor": ("a", "a"), "ceil": ("a", "a"), "round": ("a", "a"),
    "fix": ("a", "a"),
}  # fmt: skip


class Function(Block):
    """A mathematical function of a signal, element by element: ``y = function(u)``.

    Angles are in rad. The unit follows: ``square`` of m is m^2, ``sqrt`` of m^2 is m. ``round`` takes halves
    away from zero, ``fix`` rounds towards zero; lengths become whole metres. A value that the function does
    not have, such as the root of a negative number, ends the run.
    """

    function = Param("sin", choices=FUNCTIONS, doc="which function")
    u = In("float64[*]", unit="a", doc="the argument")
    y = Out("float64[*]", unit="b", doc="the value of the function")

    example = """
        angle: {block: sources.ramp, rate: fast, with: {slope: 90 deg/s}}
        height: {block: math.function, rate: fast, with: {function: sin}, in: {u: angle.y}}
    """

    @classmethod
    def ports(cls, function: int) -> dict[str, Any]:
        """Return the ports with the units of the function."""
        given, found = UNITS.get(FUNCTIONS[function], ("1", "1"))
        return {
            "u": In("float64[*]", unit=given, doc="the argument"),
            "y": Out("float64[*]", unit=found, doc="the value of the function"),
        }

    def picture_formula(self) -> tuple[str, ...]:
        """Return the function."""
        return (FUNCTIONS[self.function],)

    def output(self, u: Any) -> Any:
        """Return the value."""
        if isinstance(u, float):
            return _value(self.function, u)
        y = np.empty_like(u)
        for index in range(u.size):
            y.flat[index] = _value(self.function, u.flat[index])
        return y


def _value(function: int, x: float) -> float:
    if function <= TAN:
        return math.sin(x) if function == SIN else math.cos(x) if function == COS else math.tan(x)
    if function <= ATAN:
        return math.asin(x) if function == ASIN else math.acos(x) if function == ACOS else math.atan(x)
    if function <= TANH:
        return math.sinh(x) if function == SINH else math.cosh(x) if function == COSH else math.tanh(x)
    if function <= LOG10:
        return math.exp(x) if function == EXP else math.log(x) if function == LOG else math.log10(x)
    if function <= RECIPROCAL:
        return _power_or_sign(function, x)
    rule = FLOOR if function == DOWN else CEIL if function == UP else NEAREST if function == ROUND else FIX
    return rounded(x, rule)


def _power_or_sign(function: int, x: float) -> float:
    if function == ABS:
        return abs(x)
    if function == SIGN:
        return 1.0 if x > 0.0 else -1.0 if x < 0.0 else x
    if function == SQUARE:
        return x * x
    return math.sqrt(x) if function == SQRT else 1.0 / x
