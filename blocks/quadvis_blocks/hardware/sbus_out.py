"""Commands to a receiver, a flight controller or a radio over Futaba SBUS."""

from __future__ import annotations

from typing import Any

from quadvis.block import Initial, Param, Safe
from quadvis_blocks.hardware._pulses import CountOutput
from quadvis_blocks.hardware._sbus import FAILSAFE, LINE, encode


class SbusOut(CountOutput):
    """Commands over Futaba SBUS: 100000 baud 8E2, up to 16 channels of 11 bits, a frame every 14 ms.

    ``lowest`` to ``highest`` of a command is 172 to 1811 on the wire, 987.5 to 2011.875 us; what goes beyond
    stays at these ends, and ``highest`` below ``lowest`` reverses a channel. SBUS is idle low: between a USB
    adapter and a receiver there must be an inverter, or an FTDI adapter whose TXD is set to inverted. There
    is no checksum.
    """

    line = LINE
    rate = "spacing"

    port = Param(type="port", doc="serial port, or a cable such as pty:rc")
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end of a run, for each element")
    spacing = Param(14e-3, unit="s", min=6e-3, max=0.1, doc="from one frame to the next; 14 ms or 7 ms")
    failsafe_flag = Param(
        False, "bool", doc="safe frames carry the failsafe flag, on which many receivers act by themselves"
    )

    example = """
        sticks:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[-1, 0, 0, 0], [0.5, 0.2, 0, 0]]}
        radio:
          block: hardware.sbus_out
          rate: fast
          with:
            port: pty:rc
            channels: [3, 1, 2, 4]
            lowest: [-1, -1, -1, -1]
            highest: [1, 1, 1, 1]
            initial: [-1, 0, 0, 0]
            safe: [-1, 0, 0, 0]
          in: {command: sticks.y}
    """

    def frame(self, command: Any) -> bytes:
        """Return the frame of a command."""
        return encode(self.counts(command))

    def safe_frame(self) -> bytes:
        """Return the frame of the safe command."""
        return encode(self.counts(self.safe), FAILSAFE if self.failsafe_flag else 0)
