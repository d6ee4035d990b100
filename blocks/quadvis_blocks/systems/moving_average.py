"""The mean of the last samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, element, zeros_like
from quadvis_blocks.systems._window import held, over_window, sum_up


class MovingAverage(Block):
    """The mean of the last ``samples`` samples, for a scalar, or for each element of an array.

    ``y[k] = (u[k] + u[k-1] + ...) / samples``; until there are so many, the mean of those that there are. The
    sum does not drift, however long a run is.
    """

    samples = Param(10, type="int64", min=1, max=100_000, shown=True, doc="length of the window")
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="a", doc="the mean")
    ring = State("float64[1,*]", doc="samples, and sums of them")
    round_sum = State("float64[*]", doc="sum of the samples of this round")
    place = State("int64", doc="number of the sample in this round")
    full = State("bool", doc="whether the window is full")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        mean: {block: systems.moving_average, rate: fast, with: {samples: 5}, in: {u: wave.y}}
    """

    @classmethod
    def ports(cls, samples: int) -> dict[str, Any]:
        """Return a ring for the samples."""
        return {"ring": State(f"float64[{samples},*]", doc=cls.ring.doc)}

    def output(self, u: Any) -> Any:
        """Return the mean."""
        if isinstance(u, float):
            return over_window(self, self.ring, u, self.round_sum, 0, 1) / held(self)
        y = np.empty_like(u)
        for index in range(u.size):
            total = over_window(self, self.ring, u.flat[index], element(self.round_sum, index), index, u.size)
            y.flat[index] = total / held(self)
        return y

    def update(self, u: Any) -> None:
        """Keep the sample."""
        self.ring[self.place] = u
        self.round_sum = self.round_sum + u
        self.place += 1
        if self.place == self.samples:
            sum_up(self.ring, self.samples)
            self.round_sum = zeros_like(u)
            self.place = 0
            self.full = True
