"""Collective thrust that holds the height."""

from __future__ import annotations

import math

from quadvis.block import Block, In, Out, Param, State, Work, saturated
from quadvis_blocks._craft import GRAVITY, MASS
from quadvis_blocks.control._gains import check_gains, check_integral, gain_pair, integrated


class Altitude(Block):
    """Collective thrust that brings the height to its reference at any tilt.

    ``thrust = (r1 + m g) / max(cos(roll) cos(pitch), tilt_floor)`` with the proportional-derivative law ``r1
    = -a1 (climb - climb_reference) - a2 (height - height_reference)``. r1 is a force, held to
    ``force_limit``. The gains follow from the bandwidth: a1 = 2 m lambda and a2 = m lambda^2 give two poles
    at -lambda. ``gains`` replace these values unless both are zero.

    With an ``integral`` w, the integral of w times the height error is added to the height error, so that a
    craft of unknown mass comes to its height as well: slowly with a small w, with poles at the roots of s^3 +
    (a1 s^2 + a2 s + a2 w) / m. It stands still while r1 is at its limit.

    Source: equations (17) and (18); the integral is an addition. Error: without integral a force error d
    leaves a height error of d / a2.
    """

    bandwidth = Param(
        1.0, unit="rad/s", above=0.0, tune=True, shown=True, doc="lambda, the place of the two poles"
    )
    gains = Param(
        (0.0, 0.0), type="float64[2]", unit="N*s/m N/m", min=0.0, tune=True,
        doc="a1, a2 of equation (18); both zero: from the bandwidth",
    )  # fmt: skip
    integral = Param(
        0.0,
        unit="1/s",
        min=0.0,
        tune=True,
        doc="w, rate of the integral of the height error; 0: none, as in the paper",
    )
    mass = Param(MASS, unit="kg", above=0.0, tune=True, doc="mass of the craft; default: Draganfly IV")
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    force_limit = Param(2.0, unit="N", above=0.0, tune=True, doc="greatest |r1|")
    tilt_floor = Param(0.5, above=0.0, max=1.0, tune=True, doc="least cos(roll) cos(pitch) to divide by")
    height = In(unit="m", doc="height h, up")
    climb = In(unit="m/s", doc="rate of change of the height")
    roll = In(unit="rad", doc="roll angle")
    pitch = In(unit="rad", doc="pitch angle")
    height_reference = In(unit="m", doc="height to hold")
    climb_reference = In(unit="m/s", default=0.0, doc="rate of change of the reference")
    feedforward = In(unit="N", default=0.0, doc="upward force that balances a known disturbance")
    lasting = State(unit="m")  # the integral
    error = Work(unit="m")
    wanted = Work(unit="N")  # r1 before its limit
    thrust = Out(unit="N", doc="collective thrust u, the sum over the rotors")

    example = """
        climb: {block: sources.ramp, rate: fast, with: {slope: 0.3 m/s, initial: 1 m}}
        altitude:
          block: control.altitude
          rate: fast
          with: {bandwidth: 2 rad/s}
          in: {height: climb.y, climb: 0.3 m/s, roll: 0 rad, pitch: 5 deg, height_reference: 1.5 m}
    """

    def check(self) -> None:
        """Refuse gains of which only one is zero, and an integral that is too fast for them."""
        check_gains(self.gains)
        check_integral(self.integral, *gain_pair(self.gains, self.bandwidth, self.mass), self.mass)

    def output(
        self,
        height: float,
        climb: float,
        roll: float,
        pitch: float,
        height_reference: float,
        climb_reference: float,
        feedforward: float,
    ) -> float:
        """Return the collective thrust."""
        damping, stiffness = gain_pair(self.gains, self.bandwidth, self.mass)
        self.error = height - height_reference
        self.wanted = -damping * (climb - climb_reference) - stiffness * (self.error + self.lasting)
        lift: float = saturated(self.wanted, self.force_limit) + feedforward + self.mass * self.gravity
        upright: float = max(math.cos(pitch) * math.cos(roll), self.tilt_floor)
        return lift / upright

    def update(self) -> None:
        """Integrate the error."""
        if self.integral > 0.0:
            stiffness = gain_pair(self.gains, self.bandwidth, self.mass)[1]
            step = self.integral * self.period
            self.lasting = integrated(
                self.lasting, self.error, step, self.wanted, self.force_limit, stiffness
            )
