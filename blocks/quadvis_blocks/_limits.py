"""Limits of signals, one for all elements or one for each."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import ParameterError, element


def refuse_reversed(lower: tuple[str, Any], upper: tuple[str, Any], *, equal: bool = True) -> None:
    """Raise ParameterError if a lower limit lies above the upper one, or at it unless they may be ``equal``.

    Each limit is the name of a parameter and its value, a number or an array.
    """
    (name, least), (other, most) = lower, upper
    wrong = np.asarray(least > most if equal else least >= most)
    if wrong.any():
        found, limit = (np.broadcast_to(value, wrong.shape)[wrong][0] for value in (least, most))
        words = "at most" if equal else "below"
        raise ParameterError(name, f"{name} must be {words} {other}, {limit:g}, got {found:g}")


def bounded(value: Any, lower: Any, upper: Any, wrap: bool) -> Any:
    """Return a value between limits: held at them, or with ``wrap`` back at the other end, as an angle."""
    if isinstance(value, float):
        return _bounded(value, lower, upper, wrap)
    found = np.empty_like(value)
    for index in range(value.size):
        least, most = element(lower, index), element(upper, index)
        found.flat[index] = _bounded(value.flat[index], least, most, wrap)
    return found


def _bounded(value: float, lower: float, upper: float, wrap: bool) -> float:
    if wrap:
        span = upper - lower
        return value - span * math.floor((value - lower) / span)
    held = lower if value < lower else value
    return upper if held > upper else held
