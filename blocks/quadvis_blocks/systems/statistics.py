"""Statistics of a signal over its last samples."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks.systems._window import held, over_window, sum_up


class Statistics(Block):
    """Mean, RMS and peak of a signal over its last ``samples`` samples, for a scalar, or for each element.

    ``mean = sum(u) / n``, ``rms = sqrt(sum(u^2) / n)``, ``peak = max |u|``; until there are so many
    samples, of those that there are. The sums do not drift, however long a run is.
    """

    samples = Param(100, type="int64", min=1, max=100_000, shown=True, doc="length of the window, n")
    u = In("float64[*]", unit="a", doc="any signal")
    mean = Out("float64[*]", unit="a", doc="the mean")
    rms = Out("float64[*]", unit="a", doc="the root of the mean square, about 0")
    peak = Out("float64[*]", unit="a", doc="the largest absolute value")
    sums = State("float64[1,*]", doc="samples, and sums of them")
    squares = State("float64[1,*]", doc="the same of their squares")
    peaks = State("float64[1,*]", doc="absolute values, and the largest of them and all later ones")
    round_sum = State("float64[*]", doc="sum of this round")
    round_squares = State("float64[*]", doc="sum of squares of this round")
    round_peak = State("float64[*]", doc="largest absolute value of this round")
    place = State("int64", doc="number of the sample in this round")
    full = State("bool", doc="whether the window is full")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 2 Hz}}
        size: {block: systems.statistics, rate: fast, with: {samples: 50}, in: {u: wave.y}}
    """

    @classmethod
    def ports(cls, samples: int) -> dict[str, Any]:
        """Return rings for the samples."""
        rings = {"sums": cls.sums, "squares": cls.squares, "peaks": cls.peaks}
        return {name: State(f"float64[{samples},*]", doc=ring.doc) for name, ring in rings.items()}

    def output(self, u: Any) -> Any:
        """Return mean, RMS and peak."""
        if isinstance(u, float):
            return _of(self, u, self.round_sum, self.round_squares, self.round_peak, 0, 1)
        mean, rms, peak = np.empty_like(u), np.empty_like(u), np.empty_like(u)
        for index in range(u.size):
            mean.flat[index], rms.flat[index], peak.flat[index] = _of(
                self,
                u.flat[index],
                self.round_sum.flat[index],
                self.round_squares.flat[index],
                self.round_peak.flat[index],
                index,
                u.size,
            )
        return mean, rms, peak

    def update(self, u: Any) -> None:
        """Keep the sample."""
        self.sums[self.place] = u
        self.squares[self.place] = u * u
        self.peaks[self.place] = np.abs(u)
        self.round_sum = self.round_sum + u
        self.round_squares = self.round_squares + u * u
        if isinstance(u, float):
            self.round_peak = max(self.round_peak, abs(u))
        else:
            for index in range(u.size):
                self.round_peak.flat[index] = max(self.round_peak.flat[index], abs(u.flat[index]))
        self.place += 1
        if self.place == self.samples:
            sum_up(self.sums, self.samples)
            sum_up(self.squares, self.samples)
            _carry(self.peaks, self.samples)
            self.round_sum, self.round_squares, self.round_peak = 0.0 * u, 0.0 * u, 0.0 * u
            self.place = 0
            self.full = True


def _of(
    block: Any, u: float, total: float, squares: float, peak: float, index: int, count: int
) -> tuple[float, float, float]:
    """Return mean, RMS and peak of one element, of ``count``."""
    samples = held(block)
    mean = over_window(block, block.sums, u, total, index, count) / samples
    square = over_window(block, block.squares, u * u, squares, index, count) / samples
    most, later = max(peak, abs(u)), block.place + 1
    if block.full and later < block.samples:
        most = max(most, block.peaks.flat[later * count + index])
    return mean, math.sqrt(square), most


def _carry(ring: Any, samples: int) -> None:
    """Replace each value by the largest of it and all later ones."""
    count = ring.size // samples
    for place in range((samples - 1) * count - 1, -1, -1):
        ring.flat[place] = max(ring.flat[place], ring.flat[place + count])
