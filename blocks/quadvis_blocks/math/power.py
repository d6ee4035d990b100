"""A signal raised to a power."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out


class Power(Block):
    """A signal to the power of another one or of a constant, element by element: ``y = u ^ exponent``.

    Both are plain numbers; block `math.function` squares and takes roots with units. A negative base with an
    exponent that is not whole, and zero with a negative one, end the run.
    """

    u = In("float64[*]", doc="the base")
    exponent = In("float64[*]", doc="the exponent")
    y = Out("float64[*]", doc="the power")

    example = """
        share: {block: sources.ramp, rate: fast, with: {slope: 0.5 1/s}}
        cube: {block: math.power, rate: fast, in: {u: share.y, exponent: 3}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the power."""
        return ("uᵖ",)

    def output(self, u: Any, exponent: Any) -> Any:
        """Return the power."""
        if isinstance(u, float):
            return math.pow(u, exponent)
        y = np.empty_like(u)
        for index in range(u.size):
            y.flat[index] = math.pow(u.flat[index], exponent.flat[index])
        return y
