"""A difference of two signals."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out


class Difference(Block):
    """One signal less another, element by element: ``y = plus - minus``."""

    plus = In("float64[*]", unit="a", doc="what is taken from")
    minus = In("float64[*]", unit="a", doc="what is taken away")
    y = Out("float64[*]", unit="a", doc="the difference")

    def output(self, plus: Any, minus: Any) -> Any:
        """Return the difference."""
        return plus - minus
