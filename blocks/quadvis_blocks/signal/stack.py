"""Scalars as one vector."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out


class Stack(Block):
    """Three scalars as one vector: ``y = (a, b, c)``, such as x, y and h as a position."""

    a = In(unit="a", doc="first element")
    b = In(unit="a", default=0.0, doc="second element")
    c = In(unit="a", default=0.0, doc="third element")
    y = Out("float64[3]", unit="a", doc="the vector (a, b, c)")

    def output(self, a: float, b: float, c: float) -> Any:
        """Return the vector."""
        return np.array((a, b, c))
