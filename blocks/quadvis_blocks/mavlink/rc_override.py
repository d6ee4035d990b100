"""Channels that an autopilot takes in the place of those of its receiver."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import In, Initial, Out, Param, Safe
from quadvis_blocks.hardware._pulses import check_channels, check_ends, shares
from quadvis_blocks.mavlink._command import StationCommand

LOW, HIGH = 1000, 2000  # us, of the ends of a stick
SPAN = HIGH - LOW
CHANNELS, FIRST = 18, 8  # of the message; of its first part
IGNORED, RELEASED = (0xFFFF, 0), (0, 0xFFFE)  # in the first part and in the second


class RcOverride(StationCommand):
    """Channels in the place of those of an autopilot's receiver, RC_CHANNELS_OVERRIDE.

    ``lowest`` to ``highest`` of a command is 1000 to 2000 us; what goes beyond stays at these ends, and
    ``highest`` below ``lowest`` reverses a channel. Channels that are not named stay those of the
    receiver. The release gives all channels back to it. ArduPilot obeys the ground station alone whose
    system is its SYSID_MYGCS, 255 unless it is changed, for the time of its RC_OVERRIDE_TIME.

    See https://mavlink.io/en/messages/common.html#RC_CHANNELS_OVERRIDE.
    """

    channels = Param(type="int64[n]", min=1, max=CHANNELS, doc="channel of each element, from 1")
    lowest = Param(type="float64[n]", unit="a", doc="command of 1000 us, for each element")
    highest = Param(type="float64[n]", unit="a", doc="command of 2000 us, for each element")
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end, for ``safe_time``, for each element")
    command = In("float64[n]", unit="a", doc="the commands")
    sent = Out("float64[n]", unit="a", doc="the commands as they are sent, limited and in whole microseconds")

    example = """
        sticks:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[0, 0, -1, 0], [0.2, 0, 0.5, 0]]}
        pilot:
          block: mavlink.rc_override
          rate: fast
          with:
            port: udp:127.0.0.1:14550
            channels: [1, 2, 3, 4]
            lowest: [-1, -1, -1, -1]
            highest: [1, 1, 1, 1]
            initial: [0, 0, -1, 0]
            safe: [0, 0, -1, 0]
          in: {command: sticks.y}
    """

    def check(self) -> None:
        """Refuse wrong channels, and initial and safe commands beyond the ends."""
        super().check()
        check_channels(self.channels, self.lowest, self.highest, CHANNELS)
        check_ends(self, "initial", "safe")

    def output(self, command: Any) -> Any:
        """Return what is sent."""
        return self.lowest + (self._widths(command) - LOW) / SPAN * (self.highest - self.lowest)

    def frame(self, command: Any) -> bytes:
        """Return the message of a command."""
        return self._with([int(width) for width in self._widths(command)])

    def ending(self) -> bytes:
        """Return the message that gives the channels back."""
        return self._with([RELEASED[int(channel) > FIRST] for channel in self.channels])

    def _with(self, values: list[int]) -> bytes:
        given = dict(zip((int(channel) for channel in self.channels), values, strict=True))
        raw = {
            f"chan{channel}_raw": given.get(channel, IGNORED[channel > FIRST])
            for channel in range(1, CHANNELS + 1)
        }
        return self.framed("RC_CHANNELS_OVERRIDE", **self.target(), **raw)

    def _widths(self, command: Any) -> Any:
        return np.rint(LOW + SPAN * shares(command, self.lowest, self.highest))
