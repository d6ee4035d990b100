"""Attitudes and thrusts that an autopilot is to hold."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import In, Initial, Out, ParameterError, Safe
from quadvis_blocks.mavlink._attitude import quaternion
from quadvis_blocks.mavlink._command import StationCommand

IGNORE_RATES, IGNORE_ALL = 0x07, 0xC7  # of ATTITUDE_TARGET_TYPEMASK; all: rates, thrust and attitude


class AttitudeTarget(StationCommand):
    """Attitude and thrust as set-points of an autopilot, SET_ATTITUDE_TARGET.

    A command is roll, pitch, yaw and thrust: roll right side down, pitch nose up, yaw clockwise from north,
    thrust from 0 to 1. PX4 takes it in its mode Offboard, ArduPilot in Guided or Guided_NoGPS, where 0.5
    means to hold the height unless GUID_OPTIONS says that it is thrust. The release is a message in which
    everything is to be ignored.

    See https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET.
    """

    initial = Initial("command", doc="command before the first one")
    safe = Safe("command", doc="command at every end, for ``safe_time``")
    command = In("float64[4]", unit="rad rad rad 1", doc="roll, pitch, yaw, thrust")
    sent = Out("float64[4]", unit="rad rad rad 1", doc="the command with its thrust between 0 and 1")

    example = """
        level:
          block: sources.constant
          rate: fast
          with: {value: {value: [0, 0, 0, 0.6], unit: rad rad rad 1}}
        autopilot:
          block: mavlink.attitude_target
          rate: fast
          with:
            port: udp:127.0.0.1:14550
            initial: {value: [0, 0, 0, 0.6], unit: rad rad rad 1}
            safe: {value: [0, 0, 0, 0.55], unit: rad rad rad 1}
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
        attitude = quaternion(roll, pitch, yaw)
        return self.framed(
            "SET_ATTITUDE_TARGET", **self.target(), type_mask=IGNORE_RATES, q=attitude, thrust=thrust
        )

    def ending(self) -> bytes:
        """Return the message that releases the autopilot."""
        return self.framed("SET_ATTITUDE_TARGET", **self.target(), type_mask=IGNORE_ALL)


def limited(command: Any) -> Any:
    """Return a command with its thrust, the last number, between 0 and 1; ValueError if one is not finite."""
    if not np.isfinite(command).all():
        raise ValueError("a command must be finite")
    return np.array((*command[:-1], min(max(float(command[-1]), 0.0), 1.0)))


def check_thrust(block: Any) -> None:
    """Refuse initial and safe thrusts of a block that are not between 0 and 1."""
    for name in ("initial", "safe"):
        if not 0.0 <= getattr(block, name)[-1] <= 1.0:
            raise ParameterError(name, f"the last number of {name} is a thrust, and must lie between 0 and 1")
