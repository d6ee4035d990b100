"""A sine wave whose frequency moves."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, Out, Param, ParameterError, reached

LINEAR, LOGARITHMIC = range(2)


class Chirp(Block):
    """A sine wave whose frequency moves from one value to another, to try all frequencies in one run.

    ``y = bias + amplitude * sin(2 pi integral of f)``, where f is ``first`` at ``begin`` and ``last`` a time
    ``duration`` later, and moves linearly, or by equal factors in equal times. Before and after that
    ``y = bias``.
    """

    amplitude = Param(1.0, unit="a", tune=True, doc="half of the peak-to-peak height")
    bias = Param(0.0, unit="a", tune=True, doc="mean value")
    first = Param(0.1, unit="Hz", min=0.0, shown=True, doc="frequency at the beginning")
    last = Param(10.0, unit="Hz", min=0.0, shown=True, doc="frequency at the end")
    duration = Param(10.0, unit="s", above=0.0, doc="time from the beginning to the end")
    begin = Param(0.0, unit="s", doc="instant of the beginning")
    sweep = Param("linear", choices=("linear", "logarithmic"), doc="how the frequency moves")
    y = Out(unit="a", doc="the wave")

    symbol = "chirp"
    example = """
        probe:
          block: sources.chirp
          rate: fast
          with: {amplitude: 2 N, first: 0.5 Hz, last: 20 Hz, duration: 1 s}
    """

    def check(self) -> None:
        """Refuse frequencies that no factor leads to."""
        if self.sweep == LOGARITHMIC and (self.first == 0.0 or self.last == 0.0):
            name = "first" if self.first == 0.0 else "last"
            raise ParameterError(name, f"{name} must be above 0 Hz for a logarithmic sweep, got 0 Hz")

    def doubts(self) -> list[ParameterError]:
        """Warn of a wave that looks like a slower wave in the block's samples."""
        highest = 0.5 / self.period
        for name, frequency in (("first", self.first), ("last", self.last)):
            if frequency > highest * (1 + 1e-9):
                problem = f"{name} is {frequency:g} Hz, above half the rate of the block, {highest:g} Hz"
                return [ParameterError(name, f"{problem}; its samples are those of a slower wave")]
        return []

    def output(self, time: float) -> Any:
        """Return the value at this time."""
        elapsed = time - self.begin
        if not reached(elapsed, 0.0) or reached(elapsed, self.duration):
            return self.bias
        return self.bias + self.amplitude * math.sin(2.0 * math.pi * _turns(self, elapsed))


def _turns(chirp: Any, t: float) -> float:
    """Return how many periods have passed."""
    first, last, duration = chirp.first, chirp.last, chirp.duration
    if chirp.sweep == LINEAR or first == last:
        return float(first * t + 0.5 * (last - first) / duration * t * t)
    rate = math.log(last / first) / duration
    return float(first * math.expm1(rate * t) / rate)
