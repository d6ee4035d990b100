"""Commands to a receiver, a flight controller or a radio over Futaba SBUS."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import In, Initial, Out, Output, Param, ParameterError, Safe
from quadvis_blocks.hardware._sbus import (
    CHANNELS,
    FAILSAFE,
    LINE,
    LOW,
    SPAN,
    check_channels,
    encode,
    shares,
)


class SbusOut(Output):
    """Commands over Futaba SBUS: 100000 baud 8E2, up to 16 channels of 11 bits, a frame every 14 ms.

    ``lowest`` to ``highest`` of a command is 172 to 1811 on the wire; what goes beyond stays at these ends,
    and ``highest`` below ``lowest`` reverses a channel. SBUS is idle low: between a USB adapter and a
    receiver there must be an inverter, or an FTDI adapter whose TXD is set to inverted. There is no checksum.
    """

    line = LINE
    rate = "spacing"

    port = Param(type="port", doc="serial port, or a cable such as pty:rc")
    channels = Param(type="int64[n]", min=1, max=CHANNELS, doc="channel of each element, from 1")
    lowest = Param(type="float64[n]", unit="a", doc="command of 172, for each element")
    highest = Param(type="float64[n]", unit="a", doc="command of 1811, for each element")
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end of a run, for each element")
    spacing = Param(14e-3, unit="s", min=6e-3, max=0.1, doc="from one frame to the next; 14 ms or 7 ms")
    others = Param(LOW, "int64", min=0, max=2047, doc="what all other channels are on the wire")
    failsafe_flag = Param(
        False, "bool", doc="safe frames carry the failsafe flag, on which many receivers act by themselves"
    )
    command = In("float64[n]", unit="a", doc="the commands")
    sent = Out(
        "float64[n]", unit="a", doc="the commands as they are on the wire, limited and in whole counts"
    )

    def check(self) -> None:
        """Refuse wrong channels, and initial and safe commands beyond the ends."""
        check_channels(self.channels, self.lowest, self.highest)
        lower, upper = np.minimum(self.lowest, self.highest), np.maximum(self.lowest, self.highest)
        for name in ("initial", "safe"):
            value = getattr(self, name)
            if ((value < lower) | (value > upper)).any():
                raise ParameterError(name, f"{name} must lie between lowest and highest, element by element")

    def output(self, command: Any) -> Any:
        """Return what is sent."""
        return self.lowest + (self._counts(command) - LOW) / SPAN * (self.highest - self.lowest)

    def frame(self, command: Any) -> bytes:
        """Return the frame of a command."""
        return self._frame_with(command, 0)

    def safe_frame(self) -> bytes:
        """Return the frame of the safe command."""
        return self._frame_with(self.safe, FAILSAFE if self.failsafe_flag else 0)

    def _frame_with(self, command: Any, flags: int) -> bytes:
        counts = [self.others] * CHANNELS
        for channel, count in zip(self.channels, self._counts(command), strict=True):
            counts[channel - 1] = int(count)
        return encode(counts, flags)

    def _counts(self, command: Any) -> Any:
        return np.rint(LOW + SPAN * shares(command, self.lowest, self.highest))
