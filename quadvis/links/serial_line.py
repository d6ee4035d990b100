"""A serial line as bytes: opened once by its path, then read and written without ever waiting."""

from __future__ import annotations

from collections.abc import Iterator

from quadvis.machine.ports import PortError
from quadvis.machine.serial_port import (
    Line,
    close_port,
    has_low_latency,
    open_port,
    read_waiting,
    write_some,
)


class SerialLine:
    """An open serial port or pty of 8N1, on which frames go whole; PortError if it cannot be opened.

    ``low_latency`` says whether the driver hands bytes on at once.
    """

    def __init__(self, path: str, baud: int) -> None:
        self.path = path
        self._descriptor = open_port(path, Line(baud))
        self.low_latency = has_low_latency(self._descriptor)
        self._unsent = b""

    def write(self, data: bytes) -> bool:
        """Hand over bytes; return False, and nothing of them is sent, if those before them still wait."""
        self._unsent = self._sent(self._unsent)
        if self._unsent:
            return False
        self._unsent = self._sent(data)
        return True

    def _sent(self, data: bytes) -> bytes:
        """Send what the driver takes; return the rest."""
        try:
            return data[write_some(self._descriptor, data) :]
        except PortError as error:
            raise PortError(f"{self.path}: {error}") from error

    def read(self) -> Iterator[bytes]:
        """Yield the bytes that have come; none if the port is gone, which the age of a link shows."""
        try:
            yield read_waiting(self._descriptor)
        except PortError:
            return

    def close(self) -> None:
        """Give the port back."""
        close_port(self._descriptor)
