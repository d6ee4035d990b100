"""Commands to a flight controller in the place of a receiver, over MSP."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from quadvis.block import Initial, Line, Param, ParameterError, Safe
from quadvis_blocks.hardware._msp import SET_RAW_RC, V1, V2, encode
from quadvis_blocks.hardware._pulses import PulseOutput

VERSIONS = ("v1", "v2")
CHANNELS = 18  # that Betaflight takes


class MspRcOut(PulseOutput):
    """Commands to a flight controller with Betaflight or iNav in the place of a receiver: MSP_SET_RAW_RC.

    ``lowest`` to ``highest`` of a command is 1000 to 2000 us; what goes beyond stays at these ends. The
    controller's receiver must be set to MSP (``feature RX_MSP``), and its channels come in the order of its
    channel map, AETR as it is shipped. It goes to its failsafe if less than 5 messages come in a second, so
    ``spacing`` is at most 0.15 s. It answers each message; ``hardware.msp_in`` may have the same port, and
    counts these answers as others.

    Unlike a radio this way has no pilot's switch: keep another way to disarm.
    """

    line = Line("baud")
    rate = "spacing"
    grain, most = 1.0, CHANNELS

    port = Param(type="port", doc="serial port, or a cable such as pty:controller")
    baud = Param(115_200, type="int64", min=9_600, max=4_000_000, doc="speed of the line (1/s)")
    version = Param("v2", choices=VERSIONS, doc="of MSP: v1 has a weaker checksum, for old firmware")
    count = Param(8, type="int64", min=4, max=CHANNELS, doc="channels that are sent")
    shortest = Param(1000.0, unit="us", min=750.0, doc="pulse of lowest")
    longest = Param(2000.0, unit="us", max=2250.0, doc="pulse of highest")
    others = Param(1000.0, unit="us", min=750.0, max=2250.0, doc="what all other channels are")
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end of a run, for each element")
    spacing = Param(20e-3, unit="s", min=2e-3, max=0.15, doc="from one message to the next")

    example = """
        sticks:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[-1, 0, 0, 0], [0.5, 0.2, 0, 0]]}
        radio:
          block: hardware.msp_rc_out
          rate: fast
          with:
            port: pty:controller
            channels: [3, 1, 2, 4]
            lowest: [-1, -1, -1, -1]
            highest: [1, 1, 1, 1]
            initial: [-1, 0, 0, 0]
            safe: [-1, 0, 0, 0]
          in: {command: sticks.y}
    """

    def check(self) -> None:
        """Refuse channels that are not sent."""
        super().check()
        if (self.channels > self.count).any():
            remedy = f"give such as count: {np.max(self.channels)}"
            problem = f"channels must be at most {self.count}, the count that is sent"
            raise ParameterError("channels", f"{problem}; {remedy}")

    def frame(self, command: Any) -> bytes:
        """Return the message of a command."""
        pulses = [round(self.others)] * self.count
        for channel, pulse in zip(self.channels, self.pulses(command), strict=True):
            pulses[channel - 1] = round(pulse)
        payload = struct.pack(f"<{self.count}H", *pulses)
        return encode(SET_RAW_RC, payload, version=(V1, V2)[self.version])
