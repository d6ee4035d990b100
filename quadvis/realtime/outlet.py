"""One output port in the hands of the guardian: frames at the device's rate, written without waiting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from quadvis.machine.serial_port import Line, PortError, close_port, open_port, unsent, write_some
from quadvis.realtime.schedule import NANOSECONDS

STUCK = NANOSECONDS  # ns after which a port that takes no bytes counts as lost


@dataclass(frozen=True)
class OutputPort:
    """What the guardian knows of an output device: bytes and times, no code.

    ``path`` is that of the port, ``interval`` the time from one frame to the next (ns), ``initial`` and
    ``safe`` are whole frames.
    """

    block: str
    path: str
    line: Line
    interval: int
    initial: bytes
    safe: bytes


class Outlet:
    """Sends frames to a port, one every interval on a grid of its own; PortError if the port is lost.

    ``newest`` returns the newest frame; None before the first one, or if it cannot be read now.
    """

    def __init__(self, port: OutputPort, newest: Callable[[], bytes | None]) -> None:
        self.port, self._newest = port, newest
        self._frame = port.initial
        self._descriptor = -1
        self._rest = b""  # of a frame that the port has taken in part
        self._free = 0  # the instant from which the line can take a frame
        self.due = 0  # the instant of the next frame
        self._taken = 0  # the instant at which the port last took bytes
        self.safe_frames = 0

    @property
    def is_open(self) -> bool:
        """True if the port is open."""
        return self._descriptor >= 0

    def open(self) -> None:
        """Open the port."""
        self._descriptor = open_port(self.port.path, self.port.line)

    def close(self) -> None:
        """Close the port."""
        if self.is_open:
            close_port(self._descriptor)
            self._descriptor = -1

    def hurry(self, now: int) -> None:
        """Make the next frame due as soon as the line can take it."""
        self.due = max(now, self._free)

    def serve(self, now: int, *, safe: bool) -> None:
        """Send what is due: the safe frame, or the newest, or before the first one the initial frame."""
        if not self.is_open or now < self.due:
            return
        self._frame = self._newest() or self._frame
        interval = self.port.interval
        self.due += interval if now < self.due + interval else interval * (1 + (now - self.due) // interval)
        self._taken = self._taken or now
        try:
            if self._rest or unsent(self._descriptor):
                self._write(self._rest, now)
                return
            self._write(self.port.safe if safe else self._frame, now)
        except PortError as error:
            raise PortError(f"{self.port.path}: {error}") from error
        self.safe_frames += safe and not self._rest

    def _write(self, piece: bytes, now: int) -> None:
        """Write as much as the port takes at once."""
        count = write_some(self._descriptor, piece)
        self._rest = piece[count:]
        if count:
            self._taken = now
            taken = self.port.line.time(count) + (0.0 if self._rest else self.port.line.gap)
            self._free = now + int(NANOSECONDS * taken)
        elif now - self._taken > STUCK:
            raise PortError("the port takes no bytes")
