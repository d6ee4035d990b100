"""Element-wise mathematics that is the same for a float and for an array, interpreted and compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def copied(value: Any) -> Any:
    """Return a copy of a float or of an array of floats; the copy shares no memory with the original."""
    return 1.0 * value


def element(value: Any, index: int) -> Any:
    """Return one number of a parameter ``[*?]``: a number counts for all elements, an array has one for each.

    ``index`` counts all elements, along the last axis first.
    """
    return value if isinstance(value, float) else value.flat[index]


def zeros_like(value: Any) -> Any:
    """Return a zero for each element, with the sign of that element; all elements must be finite."""
    return 0.0 * value


def clip(value: Any, lower: Any, upper: Any) -> Any:
    """Return ``value`` held between the limits, element by element; NaN stays NaN."""
    if isinstance(value, float):
        held = lower if value < lower else value
        return upper if held > upper else held
    return np.minimum(np.maximum(value, lower), upper)


def saturated(value: float, limit: float) -> float:
    """Return ``value`` held to [-limit, limit]: sigma_a(s) of section 4; NaN stays NaN."""
    if value < -limit:
        return -limit
    return limit if value > limit else value


def all_finite(value: Any) -> bool:
    """Return whether no element is NaN or infinite."""
    if isinstance(value, float):
        return math.isfinite(value)
    return bool(np.all(np.isfinite(value)))


def inward(slope: Any, value: Any, lower: Any, upper: Any) -> Any:
    """Return ``slope``, but zero for every element of ``value`` that is at a limit and would go beyond."""
    if isinstance(value, float):
        return _inward(slope, value, lower, upper)
    found = np.empty_like(slope)
    for index in range(slope.size):
        least, most = element(lower, index), element(upper, index)
        found.flat[index] = _inward(slope.flat[index], value.flat[index], least, most)
    return found


def _inward(slope: float, value: float, lower: float, upper: float) -> float:
    return 0.0 if (value >= upper and slope > 0.0) or (value <= lower and slope < 0.0) else slope
