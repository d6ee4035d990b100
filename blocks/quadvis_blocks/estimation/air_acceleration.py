"""The acceleration by the air, from an accelerometer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks._angles import rotation, turned


class AirAcceleration(Block):
    """Acceleration of the craft along x and y by the air, from the specific force that is measured.

    The thrust points along the axis of the craft. So the specific force across that axis is the force of the
    air over the mass. It is turned into the axes x and y and smoothed by a first-order lag. The height is
    left to the known thrust, since the force along the axis is that of the rotors. A force that is not a
    number counts as still air.

    What it buys: the wind is known before it moves the craft, and the law balances it without a loop through
    the camera. What it costs: the drag of the craft's own motion is balanced too, and no longer damps it.

    Error: an accelerometer's error e, or a thrust that leans by an angle b against the unit, counts as air in
    full: e, or g b. What lasts of it is for an estimate from positions to balance, such as that of
    `estimation.position_filter`.

    Source: Leishman, Macdonald, Beard and McLain, Quadrotors and accelerometers (2014).
    """

    specific_force = In("float64[3]", unit="m/s^2", doc="acceleration without gravity: forward, right, down")
    roll = In(unit="rad", doc="right side down is positive")
    pitch = In(unit="rad", doc="nose up is positive")
    yaw = In(unit="rad", doc="clockwise from above is positive")
    acceleration = Out("float64[3]", unit="m/s^2", doc="by the air, along x and y; along h it is 0")

    time_constant = Param(0.1, unit="s", above=0.0, tune=True, shown=True, doc="of the lag")
    smooth = State("float64[3]", unit="m/s^2")
    smooth_now = Work("float64[3]", unit="m/s^2")  # with the force of this tick

    example = """
        tilt: {block: sources.sine, rate: fast, with: {amplitude: 5 deg, frequency: 1 Hz}}
        air:
          block: estimation.air_acceleration
          rate: fast
          in: {specific_force: {value: [0.1, 0, -9.81], unit: m/s^2}, roll: tilt.y, pitch: 0 rad, yaw: 0 rad}
    """

    def output(self, specific_force: Any, roll: float, pitch: float, yaw: float) -> Any:
        """Return the acceleration with the force of this tick."""
        across = np.array((float(specific_force[0]), float(specific_force[1]), 0.0))
        felt = turned(rotation(roll, pitch, yaw), across)
        felt[2] = 0.0
        if not math.isfinite(felt[0] + felt[1]):
            felt = np.zeros(3)
        share = -math.expm1(-self.period / self.time_constant)
        self.smooth_now = self.smooth + share * (felt - self.smooth)
        return self.smooth_now

    def update(self) -> None:
        """Keep the acceleration."""
        self.smooth = self.smooth_now
