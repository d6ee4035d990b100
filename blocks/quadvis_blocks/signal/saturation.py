"""A signal held between limits."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, clip
from quadvis_blocks._limits import refuse_reversed


class Saturation(Block):
    """A signal held between two limits, element by element: ``y = min(max(u, lower), upper)``.

    With ``lower = -upper`` this is the function sigma of the paper's section 4.
    """

    lower = Param(-1.0, type="float64[*?]", unit="a", tune=True, shown=True, doc="smallest value that passes")
    upper = Param(1.0, type="float64[*?]", unit="a", tune=True, shown=True, doc="largest value that passes")
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="a", doc="the signal within the limits")

    symbol = "saturation"
    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        limited: {block: signal.saturation, rate: fast, with: {lower: -1 m, upper: 1.5 m}, in: {u: wave.y}}
    """

    def check(self) -> None:
        """Refuse a lower limit above the upper limit."""
        refuse_reversed(("lower", self.lower), ("upper", self.upper))

    def output(self, u: Any) -> Any:
        """Return the signal within the limits."""
        return clip(u, self.lower, self.upper)
