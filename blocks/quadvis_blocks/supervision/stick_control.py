"""The pilot's controls, computed from his sticks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._craft import GRAVITY, MASS

ANGLE, DIRECT = range(2)


class StickControl(Block):
    """Collective thrust and torques that the sticks ask for.

    Collective: a lift of the weight plus ``force`` times the stick, at any tilt. The torques depend on
    ``mode``:

    - ``angle``: the roll and pitch torques bring the angle to ``tilt`` times the stick, with two poles at
      -bandwidth. The yaw torque brings the rate to ``turn`` times the stick, with one pole at -bandwidth.
      Sticks in the middle keep the craft level.
    - ``direct``: each torque is ``torque`` times the stick, for a craft that stabilises itself.

    A stick to the right means right side down (roll) and clockwise from above (yaw). A stick that is pulled
    back means nose up.
    """

    mode = Param("angle", choices=("angle", "direct"), doc="what roll, pitch and yaw sticks ask for")
    bandwidth = Param(4.0, unit="rad/s", above=0.0, tune=True, doc="place of the poles of mode angle")
    tilt = Param(0.26, unit="rad", above=0.0, tune=True, doc="angle at full stick, mode angle")
    turn = Param(1.0, unit="rad/s", above=0.0, tune=True, doc="yaw rate at full stick, mode angle")
    torque = Param(5.0, unit="rad/s^2", above=0.0, tune=True, doc="torque at full stick, mode direct")
    force = Param(2.0, unit="N", above=0.0, tune=True, doc="force above the weight at full stick")
    mass = Param(MASS, unit="kg", above=0.0, tune=True, doc="mass of the craft; default: Draganfly IV")
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    tilt_floor = Param(0.5, above=0.0, max=1.0, tune=True, doc="least cos(roll) cos(pitch) to divide by")
    sticks = In("float64[4]", doc="collective, roll, pitch, yaw, each -1 to 1")
    roll = In(unit="rad", doc="roll angle")
    pitch = In(unit="rad", doc="pitch angle")
    rates = In("float64[3]", unit="rad/s", doc="rates about roll, pitch and yaw axis")
    controls = Out(
        "float64[4]",
        unit="N rad/s^2 rad/s^2 rad/s^2",
        doc="collective; roll, pitch and yaw torque over inertia",
    )

    example = """
        sticks:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[0, 0, 0, 0], [0.3, 0.5, 0, 0]]}
        manual:
          block: supervision.stick_control
          rate: fast
          in: {sticks: sticks.y, roll: 2 deg, pitch: 0 rad, rates: {value: [0, 0, 0], unit: rad/s}}
    """

    def output(self, sticks: Any, roll: float, pitch: float, rates: Any) -> Any:
        """Return the controls."""
        lift = self.mass * self.gravity + self.force * sticks[0]
        collective = lift / max(math.cos(roll) * math.cos(pitch), self.tilt_floor)
        if self.mode == DIRECT:
            return np.array(
                (collective, self.torque * sticks[1], self.torque * sticks[2], self.torque * sticks[3])
            )
        pole = self.bandwidth
        return np.array(
            (
                collective,
                -2.0 * pole * rates[0] - pole * pole * (roll - self.tilt * sticks[1]),
                -2.0 * pole * rates[1] - pole * pole * (pitch - self.tilt * sticks[2]),
                -pole * (rates[2] - self.turn * sticks[3]),
            )
        )
