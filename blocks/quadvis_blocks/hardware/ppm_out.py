"""Commands to the trainer port of a radio: PPM, made by an encoder at a serial port."""

from __future__ import annotations

from typing import Any

from quadvis.block import Initial, Line, Param, Safe
from quadvis_blocks.hardware._pulses import PulseOutput


class PpmOut(PulseOutput):
    """Commands as PPM, by a PiKoder encoder (UART2PPM, USB2PPM, SPE) at a serial port: up to 8 channels.

    PPM wants a timer on one wire, so a micro-controller makes it. This block speaks the PiKoder's ASCII
    command interface, ``i=xxxx``: channel 1 to 8, and its pulse in whole microseconds, without an end mark
    (PiKoder/SPE User Manual, "ASCII Command Interface"). The encoder answers each command; nobody listens.
    There is no checksum. ``lowest`` to ``highest`` of a command is 1000 to 2000 us; what goes beyond stays at
    these ends.

    The safe frame is one like the others, so the encoder goes on with the safe pulses when nothing comes any
    more; without power the radio hears no trainer. Should computer or cable die, the encoder repeats its last
    pulses: give it a time-out and safe positions in the PiKoder Control Center where it has one. The pilot's
    trainer switch is what takes the craft back at once.
    """

    line = Line("baud")
    rate = "spacing"
    grain, most = 1.0, 8

    port = Param(type="port", doc="serial port, or a cable such as pty:ppm")
    baud = Param(9_600, type="int64", min=1_200, max=115_200, doc="that of the encoder (1/s)")
    shortest = Param(1000.0, unit="us", min=750.0, doc="pulse of lowest")
    longest = Param(2000.0, unit="us", max=2250.0, doc="pulse of highest")
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end of a run, for each element")
    spacing = Param(
        60e-3, unit="s", min=5e-3, max=1.0, doc="from one frame to the next; 20 ms are enough at 57600 baud"
    )

    example = """
        sticks:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[-1, 0, 0, 0], [0.5, 0.2, 0, 0]]}
        radio:
          block: hardware.ppm_out
          rate: fast
          with:
            port: pty:ppm
            channels: [3, 1, 2, 4]
            lowest: [-1, -1, -1, -1]
            highest: [1, 1, 1, 1]
            initial: [-1, 0, 0, 0]
            safe: [-1, 0, 0, 0]
          in: {command: sticks.y}
    """

    def frame(self, command: Any) -> bytes:
        """Return the frame of a command."""
        pulses = zip(self.channels, self.pulses(command), strict=True)
        return b"".join(b"%d=%04d" % (channel, round(pulse)) for channel, pulse in pulses)
