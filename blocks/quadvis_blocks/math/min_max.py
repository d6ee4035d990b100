"""The smallest or the largest of several signals."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param

MIN, MAX = range(2)


class MinMax(Block):
    """The smallest or the largest of several signals, element by element; NaN if one of them is NaN."""

    function = Param("min", choices=("min", "max"), doc="which of them")
    u = In("float64[*]", unit="a", many=True, doc="the signals")
    y = Out("float64[*]", unit="a", doc="the smallest or largest")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        above: {block: math.min_max, rate: fast, with: {function: max}, in: {u: [wave.y, 0 m]}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the function."""
        return (("min", "max")[self.function],)

    def output(self, *u: Any) -> Any:
        """Return the signal that is beyond all others."""
        first = u[0]
        if isinstance(first, float):
            best = first
            for place in range(1, len(u)):
                best = _beyond(self.function, best, u[place])
            return best
        found = first.copy()
        for place in range(1, len(u)):
            for index in range(first.size):
                found.flat[index] = _beyond(self.function, found.flat[index], u[place].flat[index])
        return found


def _beyond(function: int, a: float, b: float) -> float:
    if math.isnan(a) or math.isnan(b):
        return math.nan
    return b if (b < a if function == MIN else b > a) else a
