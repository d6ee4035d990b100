"""A train of rectangular pulses."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import INSTANT, Block, Out, Param, ParameterError, reached


class Pulse(Block):
    """Rectangular pulses: ``high`` for ``width`` seconds out of every ``interval``, ``low`` for the rest.

    The first pulse rises at ``begin``. A ``width`` of half the ``interval`` gives a square wave.
    """

    low = Param(0.0, unit="a", tune=True, doc="value between pulses")
    high = Param(1.0, unit="a", tune=True, shown=True, doc="value during a pulse")
    interval = Param(1.0, unit="s", above=0.0, shown=True, doc="time from one rise to the next")
    width = Param(0.5, unit="s", min=0.0, doc="time from a rise to the next fall")
    begin = Param(0.0, unit="s", doc="instant of the first rise")
    y = Out(unit="a", doc="the pulses")

    symbol = "pulse"
    stepwise = True  # a solver step that ends at a jump is without it

    example = """
        knocks: {block: sources.pulse, rate: fast, with: {high: 2 N, interval: 0.5 s, width: 0.1 s}}
    """

    def check(self) -> None:
        """Refuse pulses that are longer than their interval."""
        if self.width > self.interval:
            problem = f"width must be at most the interval, {self.interval:g} s, got {self.width:g} s"
            raise ParameterError("width", problem)

    def doubts(self) -> list[ParameterError]:
        """Warn of pulses that may fall between two samples of the block."""
        if self.width == 0.0 or reached(self.width, self.period):
            return []
        problem = f"width is {self.width:g} s, shorter than the period of the block, {self.period:g} s"
        return [ParameterError("width", f"{problem}; some pulses are missed")]

    def output(self, time: float) -> Any:
        """Return the value at this time."""
        elapsed = time - self.begin + INSTANT
        if elapsed < 0.0:
            return self.low
        phase = elapsed - self.interval * math.floor(elapsed / self.interval)
        return self.high if phase < self.width else self.low
