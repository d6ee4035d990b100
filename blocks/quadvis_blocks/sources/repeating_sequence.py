"""A signal that repeats the rows of a table."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import INSTANT, Block, Out, Param, ParameterError
from quadvis_blocks._tables import between, check_breakpoints, check_finite

LINEAR, HOLD = range(2)


class RepeatingSequence(Block):
    """A signal given by points in time, again and again; the last instant is that of the first one again.

    Between the points it moves in straight lines, or holds its value. `sources.table` plays its points once.
    """

    times = Param(
        type="float64[k]", unit="s", doc="instant of each point, rising from 0; the last one is the period"
    )
    values = Param(type="float64[k]", unit="a", doc="the value at each instant")
    interpolation = Param("linear", choices=("linear", "hold"), doc="what happens between the points")
    begin = Param(0.0, unit="s", doc="instant of the first point; before it, the sequence runs as well")
    y = Out(unit="a", doc="the signal")

    symbol = "sequence"
    example = """
        saw:
          block: sources.repeating_sequence
          rate: fast
          with: {times: {value: [0, 0.3, 0.4], unit: s}, values: {value: [0, 2, 0], unit: m}}
    """

    def check(self) -> None:
        """Refuse instants that do not rise from 0, and values that are infinite."""
        check_breakpoints("times", self.times)
        if self.times[0] != 0.0:
            raise ParameterError("times", f"times must begin with 0 s, got {self.times[0]:g} s")
        check_finite("values", self.values)
        self.stepwise = self.interpolation == HOLD

    def output(self, time: float) -> Any:
        """Return the value at this time."""
        times, values = self.times, self.values
        period = times[len(times) - 1]
        elapsed = time - self.begin
        phase = max(0.0, elapsed - period * math.floor((elapsed + INSTANT) / period))
        place = 0
        while place < len(times) - 2 and times[place + 1] <= phase + INSTANT:
            place += 1
        if self.interpolation == HOLD:
            return values[place]
        share = max(0.0, (phase - times[place]) / (times[place + 1] - times[place]))
        return between(values[place], values[place + 1], share)
