"""A difference of two signals."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out


class Difference(Block):
    """One signal minus another, element by element: ``y = plus - minus``."""

    plus = In("float64[*]", unit="a", doc="the signal with the positive sign")
    minus = In("float64[*]", unit="a", doc="the signal with the negative sign")
    y = Out("float64[*]", unit="a", doc="the difference")

    symbol = "sum"
    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        error: {block: signal.difference, rate: fast, in: {plus: 1 m, minus: wave.y}}
    """

    def picture_signs(self) -> dict[str, str]:
        """Return the two signs."""
        return {"plus": "+", "minus": "-"}

    def output(self, plus: Any, minus: Any) -> Any:
        """Return the difference."""
        return plus - minus
