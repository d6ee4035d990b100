"""Commands that come over Futaba SBUS: from a receiver, or from another computer of a diagram."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from quadvis.block import Counted, Out, Param
from quadvis_blocks.hardware._receiver import ReceiverInput
from quadvis_blocks.hardware._sbus import FAILSAFE, FRAME_LOST, LENGTH, LINE, START, decode


class SbusIn(ReceiverInput):
    """Commands that come over Futaba SBUS, the newest valid frame at each step.

    172 to 1811 on the wire, 987.5 to 2011.875 us, is ``lowest`` to ``highest`` of a command. A frame in which
    one of the ``channels`` is more than 5 % beyond these ends is refused and does not renew ``age``, since
    around a failsafe some receivers send zeros without a flag (ardupilot #9400). A frame that the receiver
    marks as lost repeats an old one, and counts as lost. So does a frame with the failsafe flag; after two of
    them in a row the link is lost, since the receiver has lost the pilot.

    Between the last valid frame and ``lost_after`` the command stays; then the link is lost, and each element
    becomes what ``on_loss`` or its role says, as before the first frame. A link is good after 5 valid frames
    in a row. There is no checksum: after damage the reader looks, one byte later, for the next place at which
    one frame ends, another begins, and the channels are in their range.
    """

    line, begin = LINE, START

    port = Param(type="port", doc="serial port, or a cable such as pty:rc")
    failsafe = Out("bool", doc="the newest frame has the failsafe flag: the receiver has lost the pilot")

    example = """
        receiver:
          block: hardware.sbus_in
          rate: fast
          with:
            port: pty:rc
            channels: [3, 1, 2, 4]
            lowest: [-1, -1, -1, -1]
            highest: [1, 1, 1, 1]
            roles: throttle stick stick stick
    """

    def open(self) -> None:
        """Open the port; where a frame begins is not known."""
        super().open()
        self._in_step = self._failsafe = False

    def frames(self, received: bytearray) -> Iterator[Sequence[int] | Counted]:
        """Take whole frames off the beginning."""
        while len(received) >= LENGTH + (not self._in_step):
            frame = decode(received[:LENGTH])
            if frame is not None and (self._in_step or received[LENGTH] == START):
                flags = frame.flags & (FRAME_LOST | FAILSAFE)
                if self.valid(frame.counts) or (self._in_step and flags):
                    del received[:LENGTH]
                    if self._failsafe and flags & FAILSAFE:
                        self._link.lose()
                    self._in_step, self._failsafe = True, bool(flags & FAILSAFE)
                    yield Counted.LOST if flags else frame.counts
                    continue
                yield Counted.REFUSED
            elif self._in_step:
                yield Counted.REFUSED
            self._in_step = False
            begin = received.find(START, 1)
            del received[: begin if begin > 0 else len(received)]

    def more(self) -> tuple[Any, ...]:
        """Return whether the receiver is in its failsafe."""
        return (self._failsafe,)
