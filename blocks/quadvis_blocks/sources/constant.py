"""A constant value."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, Out, Param


class Constant(Block):
    """The same value at every tick: ``y = value``, a scalar or an array of any shape.

    The value is tunable, so the block is a knob that can be turned during a run.
    """

    value = Param(0.0, type="float64[*]", unit="a", tune=True, shown=True, doc="the value")
    y = Out("float64[*]", unit="a", doc="the value")

    symbol = "value"
    example = """
        place: {block: sources.constant, rate: fast, with: {value: {value: [1, 2, 0.5], unit: m}}}
    """

    def output(self) -> Any:
        """Return the value."""
        return self.value
