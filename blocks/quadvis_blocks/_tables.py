"""Places in tables: between which breakpoints a value lies, and what holds outside of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import OutOfRange, ParameterError

HOLD, LINEAR, REFUSE = range(3)
OUTSIDE = ("hold", "linear", "refuse")
OUTSIDE_WORDS = "hold gives the last value, linear goes on with the last slope, refuse ends the run"


def check_breakpoints(name: str, breakpoints: Any, least: int = 2) -> None:
    """Raise ParameterError unless the breakpoints are as many as ``least`` at least, finite, and rise."""
    if len(breakpoints) < least:
        raise ParameterError(name, f"{name} must be {least} at least, got {len(breakpoints)}")
    check_finite(name, breakpoints)
    wrong = np.flatnonzero(np.diff(breakpoints) <= 0.0)
    if wrong.size:
        place = int(wrong[0]) + 1
        earlier, later = (f"{breakpoints[index]:g}" for index in (place - 1, place))
        raise ParameterError(name, f"{name} must rise; [{place}] is {later}, after {earlier}")


def check_finite(name: str, values: Any) -> None:
    """Raise ParameterError if a number is infinite."""
    if not np.isfinite(values).all():
        raise ParameterError(name, f"{name} must be finite")


def place_in(breakpoints: Any, x: float, outside: int) -> tuple[int, float]:
    """Return the interval in which a value lies, and which share of it the value has passed.

    The share is 0 at the first breakpoint of an interval and 1 at its last. Outside of all intervals it is
    held, or below 0 and above 1; OutOfRange if that is refused. NaN has the share NaN.
    """
    last = len(breakpoints) - 2
    if not breakpoints[0] <= x <= breakpoints[last + 1]:
        if outside == REFUSE and x == x:
            raise OutOfRange("the input lies outside the table")
        if outside == HOLD and x < breakpoints[0]:
            return 0, 0.0
        if outside == HOLD and x > breakpoints[last + 1]:
            return last, 1.0
    low, high = 0, last + 1
    while high - low > 1:
        middle = (low + high) // 2
        if x < breakpoints[middle]:
            high = middle
        else:
            low = middle
    return low, (x - breakpoints[low]) / (breakpoints[low + 1] - breakpoints[low])


def between(first: float, second: float, share: float) -> float:
    """Return a value on the line from one to another: at the shares 0 and 1 these, to the bit."""
    return (1.0 - share) * first + share * second
