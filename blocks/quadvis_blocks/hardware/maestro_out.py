"""Servos and speed controllers at a Pololu Maestro."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Initial, Line, Param, ParameterError, Safe
from quadvis_blocks.hardware._maestro import (
    ACCELERATION,
    ACCELERATION_UNIT,
    HOME,
    MOST,
    MULTIPLE,
    QUARTER,
    SPEED,
    SPEED_UNIT,
    TARGET,
    Wrap,
    runs,
    two_bytes,
    wrapping,
)
from quadvis_blocks.hardware._pulses import PulseOutput

POLOLU_PROTOCOL, MINI = 1, 1


class MaestroOut(PulseOutput):
    """Commands to servos and speed controllers at a Pololu Maestro, in quarters of a microsecond.

    Channel 1 is the one that the board calls 0. ``shortest`` and ``longest`` are for each channel, since a
    servo that is driven against its stop burns out; the board's own limits of its channels hold as well.
    ``speed`` and ``acceleration`` are limits that the board itself keeps, also on the way to the safe
    command; each frame states them again, so that a board that lost power has them back. ``slew`` limits what
    is sent.

    The board has a time-out of its own, which no serial command can set: in the Maestro Control Center, tab
    Serial Settings, set Timeout to some 0.2 s, and in the tab Channel Settings each channel's "On startup or
    error" to "Go to" a safe position. As it is shipped the time-out is off, and the servos keep their last
    position for ever when cable or computer die. With ``go_home`` the safe frames order just that: all
    channels to these positions.

    At USB choose the serial mode "USB Dual Port" and the command port, whose baud does not matter. At the pin
    RX (0 to 5 V, 8N1) a board that detects the baud needs the Pololu protocol.
    """

    line = Line("baud")
    rate = "spacing"
    grain, most = QUARTER, 24

    port = Param(type="port", doc="serial port, or a cable such as pty:servos")
    baud = Param(115_200, type="int64", min=300, max=200_000, doc="speed of the line (1/s)")
    shortest = Param(type="float64[n]", unit="us", min=16.0, doc="pulse of lowest, by element")
    longest = Param(type="float64[n]", unit="us", max=MOST * QUARTER, doc="pulse of highest, by element")
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end of a run, for each element")
    go_home = Param(
        False, "bool", doc="safe frames send all channels to the board's own positions, in place of `safe`"
    )
    spacing = Param(20e-3, unit="s", min=3e-3, max=1.0, doc="from one frame to the next")
    board = Param(
        "micro",
        choices=("micro", "mini"),
        doc="a Mini Maestro (12, 18 or 24 channels) takes neighbouring channels in one command",
    )
    protocol = Param(
        "compact",
        choices=("compact", "pololu"),
        doc="pololu: several boards may be at one line, by their numbers",
    )
    number = Param(12, type="int64", min=0, max=127, doc="of the board, protocol pololu")
    crc = Param(False, "bool", doc="whether the board is set to expect a checksum")
    speed = Param(0.0, unit="us/s", min=0.0, max=MOST * SPEED_UNIT, doc="limit that the board keeps; 0: none")
    acceleration = Param(
        0.0, unit="us/s^2", min=0.0, max=255 * ACCELERATION_UNIT, doc="limit that the board keeps; 0: none"
    )

    example = """
        angle: {block: sources.sine, rate: fast, with: {amplitude: 30 deg, frequency: 1 Hz}}
        both: {block: signal.concatenate, rate: fast, in: {u: [angle.y, 0 deg]}}
        servos:
          block: hardware.maestro_out
          rate: fast
          with:
            port: pty:servos
            channels: [1, 2]
            lowest: {value: [-45, -45], unit: deg}
            highest: {value: [45, 45], unit: deg}
            shortest: {value: [1000, 1000], unit: us}
            longest: {value: [2000, 2000], unit: us}
            initial: {value: [0, 0], unit: deg}
            safe: {value: [0, 0], unit: deg}
          in: {command: both.y}
    """

    def check(self) -> None:
        """Refuse what the board cannot do."""
        super().check()
        for name, unit in (("speed", SPEED_UNIT), ("acceleration", ACCELERATION_UNIT)):
            if 0 < getattr(self, name) < unit / 2:
                raise ParameterError(name, f"{name} must be 0 or at least {unit:g}, the step of the board")

    def frame(self, command: Any) -> bytes:
        """Return the frame of a command."""
        wrap = self._wrap()
        places = np.argsort(self.channels)
        channels = [int(self.channels[place]) - 1 for place in places]
        targets = [round(width / QUARTER) for width in self.pulses(command)[places]]
        return self._limits(wrap, channels) + self._targets(wrap, channels, targets)

    def safe_frame(self) -> bytes:
        """Return the frame of the safe command, or the order to go home."""
        return self._wrap()(HOME, b"") if self.go_home else self.frame(self.safe)

    def _wrap(self) -> Wrap:
        device = self.number if self.protocol == POLOLU_PROTOCOL else None
        return wrapping(device, with_checksum=self.crc)

    def _limits(self, wrap: Wrap, channels: list[int]) -> bytes:
        wanted = (SPEED, self.speed / SPEED_UNIT), (ACCELERATION, self.acceleration / ACCELERATION_UNIT)
        limits = [(command, two_bytes(round(value))) for command, value in wanted if value]
        return b"".join(
            wrap(command, bytes([channel]) + value) for channel in channels for command, value in limits
        )

    def _targets(self, wrap: Wrap, channels: list[int], targets: list[int]) -> bytes:
        pieces = [two_bytes(target) for target in targets]
        if self.board != MINI:
            each = zip(channels, pieces, strict=True)
            return b"".join(wrap(TARGET, bytes([channel]) + piece) for channel, piece in each)
        return b"".join(
            wrap(MULTIPLE, bytes([end - begin, channels[begin]]) + b"".join(pieces[begin:end]))
            for begin, end in runs(channels)
        )
