"""A sum of signals."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out


class Sum(Block):
    """Two or three signals added, element by element: ``y = a + b + c``.

    Block ``signal.difference`` subtracts.
    """

    a = In("float64[*]", unit="a", doc="first term")
    b = In("float64[*]", unit="a", doc="second term")
    c = In("float64[*]", unit="a", default=0.0, doc="third term")
    y = Out("float64[*]", unit="a", doc="the sum")

    def output(self, a: Any, b: Any, c: Any) -> Any:
        """Return the sum."""
        return a + b + c
