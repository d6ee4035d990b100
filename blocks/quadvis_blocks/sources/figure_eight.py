"""A figure eight to fly along."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, Out, Param


class FigureEight(Block):
    """Position and velocity along a lying figure eight (the lemniscate of Gerono), at a constant height.

    ``x = xc + length sin(a)``, ``y = yc + width sin(2 a)``, where the phase a grows by 2 pi in each ``lap``.
    The position rests in the middle until ``begin``. Then it starts smoothly, so that the velocity has no
    step: ``a' = (2 pi / lap) (1 - exp(-(t - begin) / start_time))``. The velocity is the exact derivative of
    the position.
    """

    centre = Param((0.0, 0.0, 1.5), type="float64[3]", unit="m", doc="x, y, h of the crossing")
    length = Param(0.4, unit="m", min=0.0, doc="reach along x, to each side")
    width = Param(0.2, unit="m", min=0.0, doc="reach along y, to each side")
    lap = Param(20.0, unit="s", above=0.0, shown=True, doc="time for one round")
    begin = Param(0.0, unit="s", doc="instant of the start")
    start_time = Param(2.0, unit="s", above=0.0, doc="time constant of the start")
    position = Out("float64[3]", unit="m", doc="x, y, h")
    velocity = Out("float64[3]", unit="m/s", doc="rate of change of the position")

    example = """
        path: {block: sources.figure_eight, rate: fast, with: {length: 0.4 m, width: 0.2 m, lap: 20 s}}
    """

    def output(self, time: float) -> tuple[Any, Any]:
        """Return the position and the velocity at this time."""
        elapsed = max(0.0, time - self.begin)
        begun = -math.expm1(-elapsed / self.start_time)
        speed = 2.0 * math.pi / self.lap
        phase = speed * (elapsed - self.start_time * begun)
        centre, rate = self.centre, speed * begun
        x = centre[0] + self.length * math.sin(phase)
        y = centre[1] + self.width * math.sin(2.0 * phase)
        vx = self.length * rate * math.cos(phase)
        vy = 2.0 * self.width * rate * math.cos(2.0 * phase)
        return np.array((x, y, centre[2])), np.array((vx, vy, 0.0))
