"""A constant factor."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param


class Gain(Block):
    """A signal times a factor, element by element: ``y = factor * u``."""

    factor = Param(
        1.0, type="float64[*?]", unit="b/a", tune=True, doc="the factor, one for all elements or one each"
    )
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="b", doc="the product")

    def output(self, u: Any) -> Any:
        """Return the product."""
        return self.factor * u
