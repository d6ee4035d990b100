"""The angle of a direction in a plane."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out


class Atan2(Block):
    """The angle of the direction (x, y), from the x axis towards the y axis, between -pi and pi.

    ``angle = atan2(y, x)``, element by element; 0 where x and y are 0.
    """

    y = In("float64[*]", unit="a", doc="the part across")
    x = In("float64[*]", unit="a", doc="the part along")
    angle = Out("float64[*]", unit="rad", doc="the angle")

    example = """
        north: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        bearing: {block: math.atan2, rate: fast, in: {y: north.y, x: 1 m}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the function."""
        return ("atan2",)

    def output(self, y: Any, x: Any) -> Any:
        """Return the angle."""
        if isinstance(y, float):
            return math.atan2(y, x)
        angle = np.empty_like(y)
        for index in range(y.size):
            angle.flat[index] = math.atan2(y.flat[index], x.flat[index])
        return angle
