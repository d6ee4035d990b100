"""Body rates and thrusts that an autopilot is to hold."""

from __future__ import annotations

from typing import Any

from quadvis.block import In, Initial, Out, Safe
from quadvis_blocks.mavlink._command import StationCommand
from quadvis_blocks.mavlink.attitude_target import IGNORE_ALL, check_thrust, limited

IGNORE_ATTITUDE = 0x80  # of ATTITUDE_TARGET_TYPEMASK


class RateTarget(StationCommand):
    """Rates and thrust as set-points of an autopilot, SET_ATTITUDE_TARGET without an attitude.

    A command has the rates about the axes forward, right and down of the craft, and a thrust from 0 to 1. For
    modes and release see `mavlink.attitude_target`.

    See https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET.
    """

    initial = Initial("command", doc="command before the first one")
    safe = Safe("command", doc="command at every end, for ``safe_time``")
    command = In("float64[4]", unit="rad/s rad/s rad/s 1", doc="rates about roll, pitch, yaw axis, thrust")
    sent = Out("float64[4]", unit="rad/s rad/s rad/s 1", doc="the command with its thrust between 0 and 1")

    example = """
        level:
          block: sources.constant
          rate: fast
          with: {value: {value: [0, 0, 0.1, 0.6], unit: rad/s rad/s rad/s 1}}
        autopilot:
          block: mavlink.rate_target
          rate: fast
          with:
            port: udp:127.0.0.1:14550
            initial: {value: [0, 0, 0, 0.6], unit: rad/s rad/s rad/s 1}
            safe: {value: [0, 0, 0, 0.55], unit: rad/s rad/s rad/s 1}
          in: {command: level.y}
    """

    def check(self) -> None:
        """Refuse initial and safe thrusts that there are not."""
        super().check()
        check_thrust(self)

    def output(self, command: Any) -> Any:
        """Return what is sent."""
        return limited(command)

    def frame(self, command: Any) -> bytes:
        """Return the message of a command."""
        roll, pitch, yaw, thrust = (float(each) for each in limited(command))
        return self.framed(
            "SET_ATTITUDE_TARGET",
            **self.target(),
            type_mask=IGNORE_ATTITUDE,
            body_roll_rate=roll,
            body_pitch_rate=pitch,
            body_yaw_rate=yaw,
            thrust=thrust,
        )

    def ending(self) -> bytes:
        """Return the message that releases the autopilot."""
        return self.framed("SET_ATTITUDE_TARGET", **self.target(), type_mask=IGNORE_ALL)
