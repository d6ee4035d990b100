"""The paper's chain of four integrators: torque in, lateral motion out."""

from __future__ import annotations

import math

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._craft import GRAVITY

ROLL, PITCH = range(2)
LINEAR, TANGENT = range(2)


class Lateral(Block):
    """Lateral motion by roll (or forward motion by pitch) without rotors, drag or yaw, for exact checks.

    Roll: y'' = g tilt(phi) + acceleration, phi'' = torque. Pitch: x'' = -g tilt(theta) + acceleration,
    theta'' = torque. The function ``tilt`` is the angle itself (``linear``) or its tangent (``tangent``).
    With a ``lag`` the torque follows its input as the thrust of a motor does: ``1 / (lag s + 1)``.

    Source: equations (20) and (21), and their counterpart for pitch.
    """

    axis = Param("roll", choices=("roll", "pitch"), doc="roll moves the craft along y, pitch along -x")
    tilt = Param(
        "linear", choices=("linear", "tangent"), doc="acceleration divided by g, as a function of the angle"
    )
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    lag = Param(0.0, unit="s", min=0.0, doc="time constant of the motors; 0: no lag")
    initial_position = Param(0.0, unit="m", doc="position at the start")
    initial_velocity = Param(0.0, unit="m/s", doc="velocity at the start")
    initial_angle = Param(0.0, unit="rad", doc="angle at the start")
    initial_rate = Param(0.0, unit="rad/s", doc="angular rate at the start")
    torque = In(unit="rad/s^2", doc="torque divided by inertia")
    acceleration = In(unit="m/s^2", default=0.0, doc="disturbance, for example by wind")
    position = Out(unit="m", doc="y for roll, x for pitch")
    velocity = Out(unit="m/s", doc="rate of change of the position")
    angle = Out(unit="rad", doc="roll or pitch angle")
    angular_rate = Out(unit="rad/s", doc="rate of change of the angle")
    place = State(unit="m", continuous=True)
    speed = State(unit="m/s", continuous=True)
    lean = State(unit="rad", continuous=True)
    spin = State(unit="rad/s", continuous=True)
    pushed = State(unit="rad/s^2", continuous=True)  # the torque behind the lag

    example = """
        torque: {block: sources.pulse, rate: fast, with: {high: 1 rad/s^2, interval: 2 s, width: 0.2 s}}
        body: {block: plant.lateral, rate: continuous, in: {torque: {from: torque.y, across: hold}}}
    """

    def start(self) -> None:
        """Begin at the initial values."""
        self.place, self.speed = self.initial_position, self.initial_velocity
        self.lean, self.spin = self.initial_angle, self.initial_rate

    def output(self) -> tuple[float, float, float, float]:
        """Return position, velocity, angle and rate."""
        return self.place, self.speed, self.lean, self.spin

    def deriv(self, torque: float, acceleration: float) -> tuple[float, float, float, float, float]:
        """Return the rates of change of position, velocity, angle, rate and torque."""
        pull = self.gravity * (math.tan(self.lean) if self.tilt == TANGENT else self.lean)
        pull = pull if self.axis == ROLL else -pull
        if self.lag == 0.0:
            return self.speed, pull + acceleration, self.spin, torque, 0.0
        return self.speed, pull + acceleration, self.spin, self.pushed, (torque - self.pushed) / self.lag
