"""The tilt and the force that balance a known disturbance."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, saturated
from quadvis_blocks._craft import GRAVITY, MASS

LEAST = 0.5  # of the weight, which the thrust is taken to carry at least


class Trim(Block):
    """Roll, pitch and upward force that balance a steady acceleration, such as that of wind.

    ``roll = -atan(a_right / (g - a_h))``, ``pitch = atan(a_forward / (g - a_h))``, ``force = -m a_h``: with
    a disturbance a_h upwards, the thrust that tilts is m (g - a_h), here at least half of the weight. Feed
    the angles to ``angle_reference`` of `control.nested_saturation`, and the force to ``feedforward`` of
    `control.altitude`. Each angle is held to ``tilt_limit``, so that a wrong estimate cannot tilt the craft
    further.
    """

    acceleration = In("float64[3]", unit="m/s^2", doc="disturbing acceleration of the craft along x, y, h")
    heading = In(unit="rad", default=0.0, doc="yaw angle psi, clockwise from above")
    roll = Out(unit="rad", doc="roll angle that balances the disturbance")
    pitch = Out(unit="rad", doc="pitch angle that balances the disturbance")
    force = Out(unit="N", doc="upward force that balances the disturbance")

    mass = Param(MASS, unit="kg", above=0.0, tune=True, doc="mass of the craft; default: Draganfly IV")
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    tilt_limit = Param(0.1, unit="rad", above=0.0, tune=True, doc="greatest angle")

    example = """
        wind:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 0], [0.5, 0.2, 0.1]], unit: m/s^2}}
        trim: {block: control.trim, rate: fast, in: {acceleration: wind.y, heading: 0 rad}}
    """

    def output(self, acceleration: Any, heading: float) -> tuple[float, float, float]:
        """Return the angles and the force."""
        cosine, sine = math.cos(heading), math.sin(heading)
        forward = cosine * float(acceleration[0]) + sine * float(acceleration[1])
        right = cosine * float(acceleration[1]) - sine * float(acceleration[0])
        lift = max(self.gravity - float(acceleration[2]), LEAST * self.gravity)
        return (
            saturated(-math.atan(right / lift), self.tilt_limit),
            saturated(math.atan(forward / lift), self.tilt_limit),
            -self.mass * float(acceleration[2]),
        )
