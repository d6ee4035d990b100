"""A car-like vehicle in the plane."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State


class Bicycle(Block):
    """A car-like vehicle in the plane, by the kinematics of a bicycle: its wheels do not slip.

    ``dx/dt = speed cos(heading)``, ``dy/dt = speed sin(heading)``,
    ``dheading/dt = speed / wheelbase tan(steering)``, with speed and steering within their limits. The place
    is that of the rear axle's middle; the heading goes on beyond a whole turn.

    Source: P. Corke, Robotics, Vision and Control, section 4.1.1.
    """

    wheelbase = Param(1.0, unit="m", above=0.0, doc="distance of the axles")
    max_speed = Param(math.inf, unit="m/s", above=0.0, doc="fastest speed, forward and back")
    max_steering = Param(
        0.45 * math.pi,
        unit="rad",
        above=0.0,
        below=0.5 * math.pi,
        doc="largest steering to either side",
    )
    initial_position = Param((0.0, 0.0), type="float64[2]", unit="m", doc="x and y at the start")
    initial_heading = Param(0.0, unit="rad", doc="heading at the start")
    speed = In(unit="m/s", doc="along the heading; negative to go back")
    steering = In(unit="rad", doc="angle of the front wheel, left is positive")
    position = Out("float64[2]", unit="m", doc="x and y")
    heading = Out(unit="rad", doc="from the x axis towards the y axis")
    place = State("float64[2]", unit="m", continuous=True)
    course = State(unit="rad", continuous=True)

    example = """
        steering: {block: sources.step, rate: continuous, with: {after: 0.3 rad, at: 0.5 s}}
        car: {block: plant.bicycle, with: {wheelbase: 2.5 m}, in: {speed: 5 m/s, steering: steering.y}}
    """

    def start(self) -> None:
        """Begin at the initial place and heading."""
        self.place, self.course = self.initial_position, self.initial_heading

    def output(self) -> tuple[Any, float]:
        """Return place and heading."""
        return self.place.copy(), self.course

    def deriv(self, speed: float, steering: float) -> tuple[Any, float]:
        """Return the rates of change of place and heading."""
        fast = min(max(speed, -self.max_speed), self.max_speed)
        turned = min(max(steering, -self.max_steering), self.max_steering)
        along = np.array([math.cos(self.course), math.sin(self.course)])
        return fast * along, fast / self.wheelbase * math.tan(turned)
