"""Commands that come over Futaba SBUS: from a receiver, or from another computer of a diagram."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from quadvis.block import Counted, Input, Out, Param
from quadvis_blocks.hardware._sbus import (
    CHANNELS,
    FAILSAFE,
    FRAME_LOST,
    HIGH,
    LENGTH,
    LINE,
    LOW,
    MARGIN,
    SPAN,
    START,
    Channels,
    check_channels,
    decode,
)


class SbusIn(Input):
    """Commands that come over Futaba SBUS, the newest whole frame at each step.

    172 to 1811 on the wire is ``lowest`` to ``highest`` of a command. A frame in which one of the
    ``channels`` is more than 5 % beyond these ends is refused, since around a failsafe some receivers send
    zeros without a flag. A frame that the receiver marks as lost repeats an old one, and counts as lost.
    After damage the reader looks for the next place at which one frame ends and another begins.
    """

    line = LINE

    port = Param(type="port", doc="serial port, or a cable such as pty:rc")
    channels = Param(type="int64[n]", min=1, max=CHANNELS, doc="channel of each element, from 1")
    lowest = Param(type="float64[n]", unit="a", doc="command of 172, for each element")
    highest = Param(type="float64[n]", unit="a", doc="command of 1811, for each element")
    command = Out("float64[n]", unit="a", nan=True, doc="the commands; NaN before the first frame")
    failsafe = Out("bool", doc="the newest frame has the failsafe flag: these are not the sender's commands")

    def check(self) -> None:
        """Refuse wrong channels."""
        check_channels(self.channels, self.lowest, self.highest)

    def open(self) -> None:
        """Open the port; where a frame begins is not known."""
        super().open()
        self._in_step = False

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take whole frames off the beginning."""
        while len(received) >= LENGTH + (not self._in_step):
            frame = decode(received[:LENGTH])
            if frame is not None and (self._in_step or received[LENGTH] == START):
                del received[:LENGTH]
                self._in_step = True
                yield self._message(frame)
                continue
            if self._in_step:
                self._in_step = False
                yield Counted.REFUSED
            begin = received.find(START, 1)
            del received[: begin if begin > 0 else len(received)]

    def _message(self, frame: Channels) -> Any:
        counts = np.array([frame.counts[channel - 1] for channel in self.channels])
        if (counts < LOW - MARGIN).any() or (counts > HIGH + MARGIN).any():
            return Counted.REFUSED
        if frame.flags & FRAME_LOST:
            return Counted.LOST
        command = self.lowest + (counts - LOW) / SPAN * (self.highest - self.lowest)
        return command, bool(frame.flags & FAILSAFE)
