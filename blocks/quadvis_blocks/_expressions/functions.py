"""The functions of expressions for one number each, the same interpreted and compiled."""

from __future__ import annotations

import math

from quadvis_blocks._rounding import CEIL, FIX, FLOOR, NEAREST, rounded


def sign(x: float) -> float:
    """Return 1 for positive numbers, -1 for negative ones, and 0 and NaN as they are."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else x


def least(x: float, y: float) -> float:
    """Return the smaller number; NaN if one is NaN."""
    if math.isnan(x) or math.isnan(y):
        return math.nan
    return y if y < x else x


def greatest(x: float, y: float) -> float:
    """Return the larger number; NaN if one is NaN."""
    if math.isnan(x) or math.isnan(y):
        return math.nan
    return y if y > x else x


def mod(x: float, divisor: float) -> float:
    """Return the rest of a division, with the sign of the divisor."""
    rest = rem(x, divisor)
    return rest + divisor if rest != 0.0 and (rest < 0.0) != (divisor < 0.0) else rest


def rem(x: float, divisor: float) -> float:
    """Return the rest of a division, with the sign of the dividend."""
    return math.copysign(abs(x) % abs(divisor), x)  # exact


def floor(x: float) -> float:
    """Return the whole number at or below."""
    return rounded(x, FLOOR)


def ceil(x: float) -> float:
    """Return the whole number at or above."""
    return rounded(x, CEIL)


def nearest(x: float) -> float:
    """Return the nearest whole number; halves go away from zero."""
    return rounded(x, NEAREST)


def fix(x: float) -> float:
    """Return the whole number towards zero."""
    return rounded(x, FIX)


def entry(value: float | bool, index: int) -> float | bool:
    """Return a number or a truth value, which counts for all elements, or the element of an array."""
    return value if isinstance(value, (float, bool)) else value.flat[index]
