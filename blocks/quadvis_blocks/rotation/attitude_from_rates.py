"""Attitude from the rates of a gyro."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._rotations import normalised, quaternion_rate, refuse_no_rotation


class AttitudeFromRates(Block):
    """The attitude of a body from its rates: ``dq/dt = q (0, rates) / 2``, over continuous time.

    The quaternion (w, x, y, z) turns body vectors into world vectors. Its norm is 1: after every solver step
    it is divided by its norm, which does not change the rotation. Its sign does not jump.

    Source: J. B. Kuipers, Quaternions and Rotation Sequences, section 11.5.
    """

    initial = Param((1.0, 0.0, 0.0, 0.0), type="float64[4]", doc="the quaternion at the start, of any norm")
    rates = In("float64[3]", unit="rad/s", doc="about the body axes x, y, z")
    y = Out("float64[4]", doc="the quaternion")
    q = State("float64[4]", continuous=True)

    example = """
        gyro: {block: sources.constant, rate: continuous, with: {value: [0 rad/s, 0.1 rad/s, 1 rad/s]}}
        attitude: {block: rotation.attitude_from_rates, in: {rates: gyro.y}}
    """

    def check(self) -> None:
        """Refuse a quaternion that is no rotation."""
        refuse_no_rotation("initial", self.initial)

    def start(self) -> None:
        """Begin with the initial attitude."""
        self.q = normalised(self.initial)

    def output(self) -> Any:
        """Return the quaternion."""
        return self.q

    def update(self) -> None:
        """Take the norm back to 1."""
        self.q = normalised(self.q)

    def deriv(self, rates: Any) -> Any:
        """Return the rate of the quaternion."""
        return quaternion_rate(self.q, rates)
