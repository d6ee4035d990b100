"""The tilt and the force that balance a known disturbance."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, saturated
from quadvis_blocks._craft import GRAVITY, MASS


class Trim(Block):
    """Roll, pitch and upward force that balance a steady acceleration, such as that of wind.

    ``roll = -atan(a_right / g)``, ``pitch = atan(a_forward / g)``, ``force = -m a_h``. Feed the angles to
    ``angle_reference`` of `control.nested_saturation`, and the force to ``feedforward`` of
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

    def output(self, acceleration: Any, heading: float) -> tuple[float, float, float]:
        """Return the angles and the force."""
        cosine, sine = math.cos(heading), math.sin(heading)
        forward = cosine * float(acceleration[0]) + sine * float(acceleration[1])
        right = cosine * float(acceleration[1]) - sine * float(acceleration[0])
        return (
            saturated(-math.atan(right / self.gravity), self.tilt_limit),
            saturated(math.atan(forward / self.gravity), self.tilt_limit),
            -self.mass * float(acceleration[2]),
        )
