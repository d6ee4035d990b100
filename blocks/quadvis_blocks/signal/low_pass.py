"""A first-order low-pass filter."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State


class LowPass(Block):
    """First-order lag ``1 / (time_constant s + 1)``, exact for an input that is held between samples.

    ``y[k+1] = y[k] + (1 - exp(-T / time_constant)) * (u[k] - y[k])``, ``y[0] = initial``. The block has no
    direct feedthrough.
    """

    time_constant = Param(0.1, unit="s", above=0.0, tune=True, shown=True, doc="time to 63 % of a step")
    initial = Param(0.0, type="float64[*?]", unit="a", doc="the output at the first sample")
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="a", doc="the smoothed signal")
    smooth = State("float64[*]")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        smooth: {block: signal.low_pass, rate: fast, with: {time_constant: 50 ms}, in: {u: wave.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the transfer function."""
        return ("1", "τ s + 1")

    def start(self) -> None:
        """Begin with the initial value."""
        self.smooth = self.initial

    def output(self) -> Any:
        """Return the smoothed signal."""
        return self.smooth

    def update(self, u: Any) -> None:
        """Move towards the input for one period."""
        self.smooth = self.smooth - math.expm1(-self.period / self.time_constant) * (u - self.smooth)
