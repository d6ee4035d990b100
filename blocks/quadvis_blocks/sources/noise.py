"""White noise."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, Out, Param, Random, State, normal_like


class Noise(Block):
    """Band-limited white noise: a new normal number at each tick of the block, held until the next tick.

    The numbers have the mean ``mean`` and the standard deviation ``sigma``. The output has the shape of
    ``sigma``; its elements are independent. As a signal in continuous time the noise has the two-sided power
    spectral density ``sigma**2 * period`` up to about half the block's rate. The numbers follow from the
    run's seed and the block's path.
    """

    sigma = Param(
        1.0,
        type="float64[*]",
        unit="a",
        min=0.0,
        tune=True,
        shown=True,
        doc="standard deviation of each sample",
    )
    mean = Param(0.0, unit="a", tune=True, doc="mean value of every element")
    y = Out("float64[*]", unit="a", doc="the noise")
    draw = State("float64[*]")
    stream = Random()

    symbol = "noise"
    example = """
        error: {block: sources.noise, rate: fast, with: {sigma: 2 cm}}
    """

    def start(self) -> None:
        """Draw the first sample."""
        self.draw = normal_like(self.stream, self.sigma)

    def output(self) -> Any:
        """Return the present sample."""
        return self.mean + self.sigma * self.draw

    def update(self) -> None:
        """Draw the next sample."""
        self.draw = normal_like(self.stream, self.sigma)
