"""The channels of a radio that ask a flight controller in angle mode for angles, a yaw rate and a thrust."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, clip, saturated
from quadvis_blocks._craft import GRAVITY, MASS, THRUST_MAX
from quadvis_blocks._thrust_curve import CURVE, command_for, thrust_share

ROTORS = 4
LOW, MIDDLE, HIGH, HALF = 1000e-6, 1500e-6, 2000e-6, 500e-6  # s


class AngleChannels(Block):
    """Pulses of five channels, in the order that Betaflight calls AETR: roll, pitch, throttle, yaw, arm.

    Full stick, 500 us from 1500 us, is the angle ``tilt`` or the yaw rate ``turn``: a long pulse means right
    side down, nose *down*, clockwise from above. Throttle follows from the thrust, by the curve of the motors
    (`plant.motor_thrust`) and by what the flight controller makes of the stick: from ``idle_command`` at the
    pulse ``throttle_low`` to full command at 2000 us. While ``idle``, throttle is 1000 us and the other
    sticks are in the middle. ``arm`` is 2000 us or 1000 us.

    ``thrust`` and ``given`` are for estimators that follow the commands: the thrust that the throttle gives,
    equal for all rotors, as the torques are the flight controller's. While ``idle`` it is the weight, which
    the ground carries.
    """

    tilt = Param(0.5235987755982988, unit="rad", above=0.0, doc="angle at full stick of roll and pitch")
    turn = Param(3.490658503988659, unit="rad/s", above=0.0, doc="yaw rate at full stick")
    thrust_max = Param(THRUST_MAX, unit="N", above=0.0, doc="greatest thrust of a rotor")
    mass = Param(MASS, unit="kg", above=0.0, tune=True, doc="mass of the craft; default: Draganfly IV")
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    curve = Param(CURVE, min=0.0, max=1.0, doc="share of the thrust that goes by the square of the command")
    idle_command = Param(0.055, min=0.0, max=0.5, doc="command of the motors at low throttle, when armed")
    throttle_low = Param(1050e-6, unit="s", min=900e-6, max=1500e-6, doc="pulse up to which throttle is low")
    collective = In(unit="N", doc="collective thrust u, the sum over the rotors")
    roll = In(unit="rad", doc="roll angle to take")
    pitch = In(unit="rad", doc="pitch angle to take")
    yaw_rate = In(unit="rad/s", doc="yaw rate to take")
    idle = In("bool", default=False, doc="true for low throttle and sticks in the middle")
    arm = In("bool", default=True, doc="whether the arm switch is on")
    channels = Out("float64[5]", unit="s", doc="pulses: roll, pitch, throttle, yaw, arm switch")
    thrust = Out("float64[4]", unit="N", doc="thrust of each rotor that the throttle gives")
    given = Out(
        "float64[4]",
        unit="N rad/s^2 rad/s^2 rad/s^2",
        doc="controls that the channels give: the collective, and no torques of ours",
    )

    example = """
        tilt: {block: sources.sine, rate: fast, with: {amplitude: 20 deg, frequency: 1 Hz}}
        channels:
          block: control.angle_channels
          rate: fast
          in: {collective: 5 N, roll: tilt.y, pitch: 0 rad, yaw_rate: 0.5 rad/s}
    """

    def check(self) -> None:
        """Refuse a craft that its motors cannot carry."""
        if self.mass * self.gravity >= ROTORS * self.thrust_max:
            problem = f"thrust_max must be above a quarter of the weight, got {self.thrust_max:g} N"
            raise ParameterError("thrust_max", problem)

    def output(
        self, collective: float, roll: float, pitch: float, yaw_rate: float, idle: bool, arm: bool
    ) -> tuple[Any, Any, Any]:
        """Return the channels, and what they give."""
        switch = HIGH if arm else LOW
        if idle:
            weight = self.mass * self.gravity
            pulses = np.array((MIDDLE, MIDDLE, LOW, MIDDLE, switch))
            return pulses, np.full(ROTORS, 0.25 * weight), np.array((weight, 0.0, 0.0, 0.0))
        most = ROTORS * self.thrust_max
        wanted = command_for(clip(collective, 0.0, most) / most, self.curve)
        share = clip((wanted - self.idle_command) / (1.0 - self.idle_command), 0.0, 1.0)
        command = self.idle_command + (1.0 - self.idle_command) * share
        lift = most * thrust_share(command, self.curve)
        pulses = np.array(
            (
                MIDDLE + HALF * saturated(roll / self.tilt, 1.0),
                MIDDLE - HALF * saturated(pitch / self.tilt, 1.0),
                self.throttle_low + share * (HIGH - self.throttle_low),
                MIDDLE + HALF * saturated(yaw_rate / self.turn, 1.0),
                switch,
            )
        )
        return pulses, np.full(ROTORS, 0.25 * lift), np.array((lift, 0.0, 0.0, 0.0))
