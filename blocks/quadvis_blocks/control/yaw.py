"""Yaw torque that holds the heading."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param, State, Work, saturated
from quadvis_blocks._angles import wrapped
from quadvis_blocks.control._gains import check_gains, check_integral, gain_pair, integrated


class Yaw(Block):
    """Yaw torque that turns the craft to the heading reference, the short way round.

    ``torque = -a1 (angular_rate - angular_rate_reference) - a2 (angle - angle_reference) + feedforward``. The
    angle error is wrapped to (-pi, pi], and the sum is held to ``torque_limit``. The gains follow from the
    bandwidth: a1 = 2 lambda and a2 = lambda^2 give two poles at -lambda. ``gains`` replace these values
    unless both are zero.

    With an ``integral`` w, the integral of w times the angle error is added to the angle error, so that a
    craft out of trim comes to its heading as well, with poles at the roots of s^3 + a1 s^2 + a2 s + a2 w. It
    stands still while the torque is at its limit.

    Source: equation (19); the integral is an addition. Error: without integral a torque error d leaves a
    heading error of d / a2.
    """

    bandwidth = Param(
        1.0, unit="rad/s", above=0.0, tune=True, shown=True, doc="lambda, the place of the two poles"
    )
    gains = Param(
        (0.0, 0.0), type="float64[2]", unit="1/s 1/s^2", min=0.0, tune=True,
        doc="a1, a2 of equation (19); both zero: from the bandwidth",
    )  # fmt: skip
    integral = Param(
        0.0,
        unit="1/s",
        min=0.0,
        tune=True,
        doc="w, rate of the integral of the angle error; 0: none, as in the paper",
    )
    torque_limit = Param(
        5.0,
        unit="rad/s^2",
        above=0.0,
        tune=True,
        doc="greatest |torque|; the rotors have the least authority about the yaw axis",
    )
    angle = In(unit="rad", doc="yaw angle psi, clockwise from above")
    angular_rate = In(unit="rad/s", doc="rate of change of the angle")
    angle_reference = In(unit="rad", default=0.0, doc="heading to hold")
    angular_rate_reference = In(unit="rad/s", default=0.0, doc="rate of change of the reference")
    feedforward = In(unit="rad/s^2", default=0.0, doc="torque that balances a known disturbance")
    lasting = State(unit="rad")  # the integral
    error = Work(unit="rad")
    wanted = Work(unit="rad/s^2")  # the torque before its limit
    torque = Out(unit="rad/s^2", doc="torque divided by inertia: the wanted angular acceleration")

    example = """
        turn: {block: sources.sine, rate: fast, with: {amplitude: 20 deg, frequency: 1 Hz}}
        rate: {block: signal.derivative, rate: fast, in: {u: turn.y}}
        yaw:
          block: control.yaw
          rate: fast
          with: {bandwidth: 2 rad/s}
          in: {angle: turn.y, angular_rate: rate.rate, angle_reference: 10 deg}
    """

    def check(self) -> None:
        """Refuse gains of which only one is zero, and an integral that is too fast for them."""
        check_gains(self.gains)
        check_integral(self.integral, *gain_pair(self.gains, self.bandwidth, 1.0), 1.0)

    def output(
        self,
        angle: float,
        angular_rate: float,
        angle_reference: float,
        angular_rate_reference: float,
        feedforward: float,
    ) -> float:
        """Return the yaw torque."""
        damping, stiffness = gain_pair(self.gains, self.bandwidth, 1.0)
        self.error = wrapped(angle - angle_reference)
        self.wanted = (
            -damping * (angular_rate - angular_rate_reference)
            - stiffness * (self.error + self.lasting)
            + feedforward
        )
        return saturated(self.wanted, self.torque_limit)

    def update(self) -> None:
        """Integrate the error."""
        if self.integral > 0.0:
            stiffness = gain_pair(self.gains, self.bandwidth, 1.0)[1]
            step = self.integral * self.period
            self.lasting = integrated(
                self.lasting, self.error, step, self.wanted, self.torque_limit, stiffness
            )
