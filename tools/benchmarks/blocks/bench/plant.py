"""The craft of task a."""

from __future__ import annotations

from math import cos, sin

from benchmarks.tasks import GRAVITY, MASS, START
from quadvis.block import Block, In, Out, State


class Plant(Block):
    """Twelve continuous states of a four-rotor craft: equations (11) to (16) of the paper."""

    thrust, yaw, pitch, roll = In(doc="N"), In(doc="rad/s^2"), In(doc="rad/s^2"), In(doc="rad/s^2")
    x, y, z = Out(), Out(), Out()
    psi, theta, phi = Out(), Out(), Out()
    vx, vy, vz = Out(), Out(), Out()
    wpsi, wtheta, wphi = Out(), Out(), Out()
    s0, s1, s2 = State(continuous=True), State(continuous=True), State(continuous=True)
    s3, s4, s5 = State(continuous=True), State(continuous=True), State(continuous=True)
    s6, s7, s8 = State(continuous=True), State(continuous=True), State(continuous=True)
    s9, s10, s11 = State(continuous=True), State(continuous=True), State(continuous=True)

    def start(self) -> None:
        """Begin away from the wanted pose."""
        self.s0, self.s1, self.s2, self.s3 = START[0], START[1], START[2], START[3]

    def output(self) -> tuple[float, ...]:
        """Return the states."""
        return (
            self.s0, self.s1, self.s2, self.s3, self.s4, self.s5,
            self.s6, self.s7, self.s8, self.s9, self.s10, self.s11,
        )  # fmt: skip

    def deriv(self, thrust: float, yaw: float, pitch: float, roll: float) -> tuple[float, ...]:
        """Return their rates."""
        pull = thrust / MASS
        level = pull * cos(self.s4)
        return (
            self.s6, self.s7, self.s8, self.s9, self.s10, self.s11,
            -pull * sin(self.s4), level * sin(self.s5), level * cos(self.s5) - GRAVITY, yaw, pitch, roll,
        )  # fmt: skip
