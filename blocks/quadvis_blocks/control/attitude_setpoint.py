"""Attitude and thrust that bring a craft to its place, for an autopilot that holds attitudes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, clip
from quadvis_blocks._craft import GRAVITY, THRUST_MAX


class AttitudeSetpoint(Block):
    """Attitude and thrust that bring a craft to its place, for an autopilot that holds attitudes.

    ``pitch = (2 lambda v + lambda^2 e) / g`` with the error and its rate forward, and minus the same with
    those to the right for roll: near hover this gives two poles at -lambda for each, if the autopilot is
    faster. Both stay within ``tilt_limit``. Yaw is the heading that is wanted; thrust is the collective of
    `control.altitude` as a part of ``full_thrust``, between 0 and 1.

    Source: the outer loop of equations (11) and (12), linear in the tilt; the paper's own laws give torques.
    """

    bandwidth = Param(
        1.0, unit="rad/s", above=0.0, tune=True, shown=True, doc="lambda, the place of the two poles"
    )
    tilt_limit = Param(
        0.2, unit="rad", above=0.0, below=0.5 * math.pi, tune=True, doc="greatest |roll|, |pitch|"
    )
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    full_thrust = Param(
        4 * THRUST_MAX, unit="N", above=0.0, doc="collective thrust that the autopilot calls 1"
    )
    forward = In(unit="m", doc="how far the craft is ahead of its place")
    right = In(unit="m", doc="how far it is to the right")
    forward_velocity = In(unit="m/s", doc="rate of change of forward")
    right_velocity = In(unit="m/s", doc="rate of change of right")
    heading = In(unit="rad", doc="yaw to hold")
    collective = In(unit="N", doc="collective thrust")
    command = Out("float64[4]", unit="rad rad rad 1", doc="roll, pitch, yaw, thrust")

    example = """
        ahead: {block: sources.sine, rate: fast, with: {amplitude: 1 m, frequency: 0.5 Hz}}
        speed: {block: signal.derivative, rate: fast, in: {u: ahead.y}}
        setpoint:
          block: control.attitude_setpoint
          rate: fast
          in:
            forward: ahead.y
            forward_velocity: speed.rate
            right: 0.1 m
            right_velocity: 0 m/s
            heading: 0 rad
            collective: 5 N
    """

    def output(
        self,
        forward: float,
        right: float,
        forward_velocity: float,
        right_velocity: float,
        heading: float,
        collective: float,
    ) -> Any:
        """Return the command."""
        fast, slow = 2.0 * self.bandwidth / self.gravity, self.bandwidth * self.bandwidth / self.gravity
        limit = self.tilt_limit
        roll = clip(-fast * right_velocity - slow * right, -limit, limit)
        pitch = clip(fast * forward_velocity + slow * forward, -limit, limit)
        return np.array((roll, pitch, heading, clip(collective / self.full_thrust, 0.0, 1.0)))
