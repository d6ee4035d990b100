"""White noise between two limits."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Out, Param, Random, State, fill_uniform, uniform
from quadvis_blocks._limits import refuse_reversed


class UniformNoise(Block):
    """A new random number between two limits at each tick of the block, held until the next tick.

    All numbers between the limits are equally likely. The output has the shape of ``lower``; its elements are
    independent. The numbers follow from the run's seed and the block's path.
    """

    lower = Param(-1.0, type="float64[*]", unit="a", tune=True, shown=True, doc="lower limit")
    upper = Param(
        1.0,
        type="float64[*?]",
        unit="a",
        tune=True,
        shown=True,
        doc="upper limit, one for all elements or one each",
    )
    y = Out("float64[*]", unit="a", doc="the noise")
    draw = State("float64[*]", doc="numbers between 0 and 1")
    stream = Random()

    symbol = "noise"
    example = """
        shaking: {block: sources.uniform_noise, rate: fast, with: {lower: -2 cm, upper: 2 cm}}
    """

    def check(self) -> None:
        """Refuse a lower limit above the upper limit."""
        refuse_reversed(("lower", self.lower), ("upper", self.upper))

    def start(self) -> None:
        """Draw the first sample."""
        self.draw = _drawn(self.stream, self.lower)

    def output(self) -> Any:
        """Return the present sample."""
        return self.lower + (self.upper - self.lower) * self.draw

    def update(self) -> None:
        """Draw the next sample."""
        self.draw = _drawn(self.stream, self.lower)


def _drawn(stream: Any, like: Any) -> Any:
    """Return numbers between 0 and 1, as many as ``like`` has elements."""
    if isinstance(like, float):
        return uniform(stream)
    numbers = np.empty_like(like)
    fill_uniform(stream, numbers.reshape(-1))
    return numbers
