"""A constant factor."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param


class Gain(Block):
    """A signal times a factor, element by element: ``y = factor * u``."""

    factor = Param(
        1.0,
        type="float64[*?]",
        unit="b/a",
        tune=True,
        shown=True,
        doc="the factor, one for all elements or one each",
    )
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="b", doc="the product")

    symbol = "gain"
    example = """
        speed: {block: sources.sine, rate: fast, with: {amplitude: 1 m/s, frequency: 1 Hz}}
        drag: {block: signal.gain, rate: fast, with: {factor: -2 N*s/m}, in: {u: speed.y}}
    """

    def output(self, u: Any) -> Any:
        """Return the product."""
        return self.factor * u
