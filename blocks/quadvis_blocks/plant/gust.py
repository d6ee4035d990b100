"""Gusty wind."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, Out, Param, Random, State, fill_normal, reached


class Gust(Block):
    """Wind that wanders about a mean: a first-order Gauss-Markov process along each axis.

    The axes are independent of each other. Each process has the mean ``mean``, the standard deviation ``rms``
    and the autocorrelation exp(-|t| / correlation_time). Its samples are exact at any rate of the block, and
    stationary from the first sample on. From ``step_time`` on, the mean wind is ``mean + step``.
    """

    rms = Param(
        (0.2, 0.2, 0.2),
        type="float64[3]",
        unit="m/s",
        min=0.0,
        tune=True,
        shown=True,
        doc="standard deviation along x, y, h",
    )
    correlation_time = Param(
        2.0, unit="s", above=0.0, tune=True, doc="time after which the correlation has fallen by 63 %"
    )
    mean = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m/s", tune=True, doc="mean wind along x, y, h")
    step = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="m/s", tune=True, doc="by which the mean wind changes, once"
    )
    step_time = Param(0.0, unit="s", min=0.0, tune=True, doc="when it changes")
    wind = Out("float64[3]", unit="m/s", doc="velocity of the air along x, y, h")
    state = State("float64[3]")  # in standard deviations
    fresh = State("float64[3]")  # the random numbers of this tick
    stream = Random()

    example = """
        wind: {block: plant.gust, rate: fast}
    """

    def start(self) -> None:
        """Draw the first wind."""
        fill_normal(self.stream, self.state)

    def output(self, time: float) -> Any:
        """Return the present wind."""
        stepped = 1.0 if reached(time, self.step_time) else 0.0
        return self.mean + stepped * self.step + self.rms * self.state

    def update(self) -> None:
        """Advance the process by one period."""
        keep = math.exp(-self.period / self.correlation_time)
        fill_normal(self.stream, self.fresh)
        self.state = keep * self.state + math.sqrt(1.0 - keep * keep) * self.fresh
