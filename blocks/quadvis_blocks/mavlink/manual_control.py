"""Sticks that an autopilot takes for those of a pilot."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import In, Initial, Out, ParameterError, Safe
from quadvis_blocks.mavlink._command import StationCommand

COUNTS = 1000  # of a full stick
INVALID = 0x7FFF  # an axis that says nothing
LOWEST = np.array((-1.0, -1.0, -1.0, 0.0))


class ManualControl(StationCommand):
    """Sticks as a joystick gives them to an autopilot, MANUAL_CONTROL.

    A command is roll, pitch and yaw from -1 to 1, and throttle from 0 to 1: right side down, nose up (the
    stick is pulled back) and clockwise from above are positive. The message has the stick forward as
    positive; its yaw is positive to the right, as autopilots and ground stations have it. ArduPilot obeys
    the ground station alone whose system is its SYSID_MYGCS, 255 unless it is changed. The release is a
    message whose axes all say nothing.

    See https://mavlink.io/en/messages/common.html#MANUAL_CONTROL.
    """

    initial = Initial("command", doc="command before the first one")
    safe = Safe("command", doc="command at every end, for ``safe_time``")
    command = In("float64[4]", doc="roll, pitch, yaw, throttle")
    sent = Out("float64[4]", doc="the command within its limits, in whole counts of 1/1000")

    example = """
        sticks:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[0, 0, 0, 0], [0.2, 0, 0, 0.5]]}
        pilot:
          block: mavlink.manual_control
          rate: fast
          with: {port: udp:127.0.0.1:14550, initial: [0, 0, 0, 0], safe: [0, 0, 0, 0]}
          in: {command: sticks.y}
    """

    def check(self) -> None:
        """Refuse initial and safe commands beyond the ends of the sticks."""
        super().check()
        for name in ("initial", "safe"):
            value = getattr(self, name)
            if (value < LOWEST).any() or (value > 1.0).any():
                raise ParameterError(
                    name, f"{name} must lie between -1 and 1, and its throttle between 0 and 1"
                )

    def output(self, command: Any) -> Any:
        """Return what is sent."""
        return _counts(command) / COUNTS

    def frame(self, command: Any) -> bytes:
        """Return the message of a command."""
        roll, pitch, yaw, throttle = (int(each) for each in _counts(command))
        return self.framed("MANUAL_CONTROL", target=self.target_system, x=-pitch, y=roll, z=throttle, r=yaw)

    def ending(self) -> bytes:
        """Return the message that releases the autopilot."""
        return self.framed(
            "MANUAL_CONTROL", target=self.target_system, x=INVALID, y=INVALID, z=INVALID, r=INVALID
        )


def _counts(command: Any) -> Any:
    if not np.isfinite(command).all():
        raise ValueError("a command must be finite")
    return np.rint(COUNTS * np.clip(command, LOWEST, 1.0))
