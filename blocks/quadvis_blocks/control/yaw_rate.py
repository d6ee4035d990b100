"""Yaw rate that brings the heading to its reference."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param, saturated
from quadvis_blocks._angles import wrapped


class YawRate(Block):
    """Yaw rate that turns the craft to the heading reference, the short way round.

    ``rate = -bandwidth / 2 * (angle - angle_reference)``, the error wrapped to (-pi, pi]: the rate at which
    `control.yaw` asks for no torque, for a craft whose flight controller holds the rate. It is held to
    ``limit``.

    Source: equation (19) without its damping, which the flight controller has.
    """

    bandwidth = Param(1.0, unit="rad/s", above=0.0, tune=True, shown=True, doc="lambda of control.yaw")
    limit = Param(1.0, unit="rad/s", above=0.0, tune=True, doc="greatest |rate|")
    angle = In(unit="rad", doc="yaw angle psi, clockwise from above")
    angle_reference = In(unit="rad", default=0.0, doc="heading to hold")
    rate = Out(unit="rad/s", doc="yaw rate to take")

    example = """
        turn: {block: sources.ramp, rate: fast, with: {slope: 60 deg/s}}
        yaw_rate: {block: control.yaw_rate, rate: fast, in: {angle: turn.y, angle_reference: 30 deg}}
    """

    def output(self, angle: float, angle_reference: float) -> float:
        """Return the rate."""
        wanted = -0.5 * self.bandwidth * wrapped(angle - angle_reference)
        return float(saturated(wanted, self.limit))
