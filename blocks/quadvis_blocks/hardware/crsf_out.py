"""Commands to a flight controller, a receiver or a transmitter module over CRSF."""

from __future__ import annotations

from typing import Any

from quadvis.block import Initial, Line, Param, Safe
from quadvis_blocks.hardware._crsf import SYNCS, encode
from quadvis_blocks.hardware._pulses import CountOutput


class CrsfOut(CountOutput):
    """Commands over CRSF (Crossfire, ExpressLRS): up to 16 channels of 11 bits in frames with a checksum.

    ``lowest`` to ``highest`` of a command is 987.5 to 2011.875 us, 172 to 1811 on the wire; what goes beyond
    stays at these ends, and ``highest`` below ``lowest`` reverses a channel. The line is 3.3 V, 8N1, not
    inverted: 416666 baud by the specification, 420000 with Betaflight and ExpressLRS, 400000 in the bay of a
    handset. There one wire carries both directions: the adapter must let go of it while the module answers.

    CRSF has no flag for a failsafe: a receiver takes silence for it, after some 0.5 to 1 s. So the safe
    frames are plain frames with the ``safe`` command, as long as the guardian lives; once it has closed the
    port nothing comes, and the receiver does what its own failsafe is set to.
    """

    line = Line("baud")
    rate = "spacing"

    port = Param(type="port", doc="serial port, or a cable such as pty:rc")
    baud = Param(420_000, type="int64", min=9_600, max=4_000_000, doc="speed of the line (1/s)")
    to = Param(
        "flight_controller",
        choices=("flight_controller", "module"),
        doc="who reads: frames begin with 0xC8 for a flight controller, with 0xEE for a transmitter module",
    )
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end of a run, for each element")
    spacing = Param(10e-3, unit="s", min=1e-3, max=0.1, doc="from one frame to the next; 2 to 20 ms")

    example = """
        sticks:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[-1, 0, 0, 0], [0.5, 0.2, 0, 0]]}
        radio:
          block: hardware.crsf_out
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
        return encode(self.counts(command), SYNCS[self.to])
