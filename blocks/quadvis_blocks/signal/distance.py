"""The distance between two points."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out


class Distance(Block):
    """How far apart two points are: ``y = |a - b|``, in the plane, in space or along a line."""

    a = In("float64[n]", unit="a", doc="a point")
    b = In("float64[n]", unit="a", doc="another point")
    y = Out(unit="a", doc="the distance between them, not negative")

    example = """
        here: {block: sources.constant, rate: fast, with: {value: {value: [1, 2, 0], unit: m}}}
        there: {block: sources.constant, rate: fast, with: {value: {value: [4, 6, 0], unit: m}}}
        apart: {block: signal.distance, rate: fast, in: {a: here.y, b: there.y}}
    """

    def output(self, a: Any, b: Any) -> float:
        """Return the length of the difference."""
        total = 0.0
        for index in range(a.size):
            total += (a[index] - b[index]) ** 2
        return math.sqrt(total)
