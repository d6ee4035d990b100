"""Commands that come over CRSF: from a receiver, a radio, or from another computer of a diagram."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from typing import Any

from quadvis.block import Counted, Line, Out, Param
from quadvis_blocks.hardware._counts import unpacked
from quadvis_blocks.hardware._crsf import CHANNELS, SYNCS, CrsfDecoder, Spoilt
from quadvis_blocks.hardware._receiver import ReceiverInput

STATISTICS = struct.Struct("BBBb6x")  # what is read of them: of the link to the craft


class CrsfIn(ReceiverInput):
    """Commands that come over CRSF (Crossfire, ExpressLRS), the newest valid frame at each step.

    172 to 1811 on the wire, 987.5 to 2011.875 us, is ``lowest`` to ``highest`` of a command. Frames may begin
    with 0xC8 or 0xEE. A length outside 2 to 62 is dropped at once; after a wrong checksum the search goes on
    one byte later. A frame in which one of the ``channels`` is more than 5 % beyond its ends is refused and
    does not renew ``age``.

    On a failsafe CRSF frames stop. Between the last valid frame and ``lost_after`` the command stays; then
    the link is lost, and each element becomes what ``on_loss`` or its role says, as before the first frame. A
    link is good after 5 valid frames in a row. Statistics that go on show that the receiver lives.
    """

    line, begin = Line("baud"), SYNCS[0]

    port = Param(type="port", doc="serial port, or a cable such as pty:rc")
    baud = Param(420_000, type="int64", min=9_600, max=4_000_000, doc="speed of the line (1/s)")
    quality = Out(nan=True, doc="share of packets that reach the receiver, 0 to 1; NaN before statistics")
    rssi = Out(nan=True, doc="power at the receiver's better antenna (dBm)")
    snr = Out(nan=True, doc="signal-to-noise ratio at the receiver (dB)")
    statistics_age = Out(unit="s", nan=True, doc="time since the newest statistics came")

    example = """
        receiver:
          block: hardware.crsf_in
          rate: fast
          with:
            port: pty:rc
            channels: [3, 1, 2, 4]
            lowest: [-1, -1, -1, -1]
            highest: [1, 1, 1, 1]
            roles: throttle stick stick stick
    """

    def open(self) -> None:
        """Open the port; nothing has come."""
        super().open()
        self._decoder = CrsfDecoder()
        self._statistics, self._came = (math.nan,) * 3, math.nan

    def frames(self, received: bytearray) -> Iterator[Sequence[int] | Counted]:
        """Take whole frames off the beginning."""
        for found in self._decoder.take(received):
            if isinstance(found, Spoilt):
                yield Counted.REFUSED
            elif found.kind == CHANNELS:
                yield unpacked(found.payload)
            else:
                one, other, percent, ratio = STATISTICS.unpack(found.payload)
                self._statistics = percent / 100, -float(min(one, other or one)), float(ratio)
                self._came = self._now

    def more(self) -> tuple[Any, ...]:
        """Return the statistics of the link, and their age."""
        return (*self._statistics, self._now - self._came)
