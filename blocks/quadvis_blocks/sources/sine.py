"""A sine wave."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, Out, Param, ParameterError


class Sine(Block):
    """A sine wave: ``y = bias + amplitude * sin(2 pi frequency t + phase)``."""

    amplitude = Param(1.0, unit="a", tune=True, shown=True, doc="half of the peak-to-peak height")
    frequency = Param(1.0, unit="Hz", min=0.0, tune=True, shown=True, doc="cycles per second")
    phase = Param(0.0, unit="rad", tune=True, doc="phase at t = 0")
    bias = Param(0.0, unit="a", tune=True, doc="mean value")
    y = Out(unit="a", doc="the wave")

    symbol = "sine"
    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 0.5 Hz, phase: 90 deg}}
    """

    def doubts(self) -> list[ParameterError]:
        """Warn of a wave that looks like a slower wave in the block's samples."""
        highest = 0.5 / self.period
        if self.frequency <= highest * (1 + 1e-9):
            return []
        problem = f"frequency is {self.frequency:g} Hz, above half the rate of the block, {highest:g} Hz"
        return [ParameterError("frequency", f"{problem}; its samples are those of a slower wave")]

    def output(self, time: float) -> Any:
        """Return the value at this time."""
        return self.bias + self.amplitude * math.sin(2.0 * math.pi * self.frequency * time + self.phase)
