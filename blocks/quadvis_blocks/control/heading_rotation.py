"""Position and velocity errors in the frame of the craft's heading."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param


class HeadingRotation(Block):
    """Horizontal position and velocity relative to a reference, turned into the frame of the craft's heading.

    ``forward = cos(psi) dx + sin(psi) dy``, ``right = -sin(psi) dx + cos(psi) dy``; the velocities are turned
    likewise. The paper's laws assume psi = 0: without this rotation the paper's loop is unstable from 43.55
    deg of yaw on. The outputs are errors: feed them to ``control.nested_saturation`` with references of zero.
    """

    enabled = Param(True, type="bool", tune=True, doc="false to give the errors unturned, as in the paper")
    offset = Param(
        0.0, unit="rad", tune=True, doc="added to the heading, for example for a camera mounted askew"
    )
    position = In("float64[3]", unit="m", doc="x, y, h")
    velocity = In("float64[3]", unit="m/s", doc="rate of change of the position")
    heading = In(unit="rad", doc="yaw angle psi, clockwise from above")
    position_reference = In("float64[3]", unit="m", default=(0.0, 0.0, 0.0), doc="where to go: x, y, h")
    velocity_reference = In(
        "float64[3]", unit="m/s", default=(0.0, 0.0, 0.0), doc="rate of change of the reference"
    )
    forward = Out(unit="m", doc="how far the craft is ahead of the reference")
    right = Out(unit="m", doc="how far the craft is to the right of the reference")
    forward_velocity = Out(unit="m/s", doc="rate of change of forward at a constant heading")
    right_velocity = Out(unit="m/s", doc="rate of change of right at a constant heading")

    example = """
        turn: {block: sources.ramp, rate: fast, with: {slope: 90 deg/s}}
        errors:
          block: control.heading_rotation
          rate: fast
          in:
            position: {value: [1, 0, 1.5], unit: m}
            velocity: {value: [0, 0.2, 0], unit: m/s}
            heading: turn.y
    """

    def output(
        self, position: Any, velocity: Any, heading: float, position_reference: Any, velocity_reference: Any
    ) -> tuple[float, float, float, float]:
        """Return the errors: forward, right and their rates."""
        heading = heading + self.offset if self.enabled else 0.0
        cosine, sine = math.cos(heading), math.sin(heading)
        x = float(position[0] - position_reference[0])
        y = float(position[1] - position_reference[1])
        vx = float(velocity[0] - velocity_reference[0])
        vy = float(velocity[1] - velocity_reference[1])
        return cosine * x + sine * y, cosine * y - sine * x, cosine * vx + sine * vy, cosine * vy - sine * vx
