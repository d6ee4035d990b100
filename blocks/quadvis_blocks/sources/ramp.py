"""A ramp in time."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, Out, Param


class Ramp(Block):
    """A value that grows steadily from an instant on: ``y = initial + slope * max(0, t - begin)``."""

    slope = Param(1.0, unit="a/s", tune=True, shown=True, doc="rate of change after the beginning")
    initial = Param(0.0, unit="a", tune=True, doc="value up to the beginning")
    begin = Param(0.0, unit="s", tune=True, doc="instant at which it begins to change")
    y = Out(unit="a", doc="the ramp")

    symbol = "ramp"
    example = """
        height: {block: sources.ramp, rate: fast, with: {slope: 0.3 m/s, begin: 0.2 s}}
    """

    def output(self, time: float) -> Any:
        """Return the value at this time."""
        return self.initial + self.slope * max(0.0, time - self.begin)
