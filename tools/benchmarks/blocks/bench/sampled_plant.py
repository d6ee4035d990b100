"""The craft of task b."""

from __future__ import annotations

from math import cos, sin
from typing import Any

from benchmarks.tasks import GRAVITY, MASS, START
from quadvis.block import Block, In, Out, State


class SampledPlant(Block):
    """The twelve states of a four-rotor craft as one signal, by Euler's method."""

    u = In("float64[4]")
    s = Out("float64[12]")
    now = State("float64[12]")

    def start(self) -> None:
        """Begin away from the wanted pose."""
        for index in range(12):
            self.now[index] = START[index]

    def output(self) -> Any:
        """Return the states."""
        return self.now

    def update(self, u: Any) -> None:
        """Move over one period."""
        s, step = self.now, self.period
        pull = u[0] / MASS
        level = pull * cos(s[4])
        ax, ay, az = -pull * sin(s[4]), level * sin(s[5]), level * cos(s[5]) - GRAVITY
        for index in range(6):
            s[index] += step * s[6 + index]
        s[6] += step * ax
        s[7] += step * ay
        s[8] += step * az
        for index in range(3):
            s[9 + index] += step * u[1 + index]
