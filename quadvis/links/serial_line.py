"""A serial line as bytes: opened once by its path, then read and written without ever waiting."""

from __future__ import annotations

import os
import termios
from collections.abc import Iterator

from quadvis.errors import QuadvisError
from quadvis.machine.files import reason

MOST = 1 << 16  # bytes at one reading
PIECE = 1 << 12


class SerialLine:
    """An open serial port or pty: raw (8N1, no flow control), non-blocking, and nobody else's.

    ``low_latency`` says whether the driver hands bytes on at once, which it is asked to do. QuadvisError if
    the port cannot be opened or is in use.
    """

    def __init__(self, path: str, baud: int) -> None:
        from serial import Serial, SerialException

        self.path = path
        try:
            # Exclusive means both locks: flock against programs that ask, TIOCEXCL against all others.
            self._port = Serial(path, baud, timeout=0, write_timeout=0, exclusive=True)
        except (SerialException, OSError, ValueError) as error:
            raise QuadvisError(f"cannot open the serial port '{path}': {_words(error)}") from error
        self._file = self._port.fileno()
        self._lock()
        self.low_latency = self._hurry()
        self._unsent = b""

    def _lock(self) -> None:
        import fcntl

        fcntl.ioctl(self._file, termios.TIOCEXCL)
        termios.tcflush(self._file, termios.TCIOFLUSH)

    def _hurry(self) -> bool:
        try:
            self._port.set_low_latency_mode(True)
        except (OSError, ValueError, AttributeError):
            return False
        return True

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
            return data[os.write(self._file, data) :] if data else data
        except BlockingIOError:
            return data

    def read(self) -> Iterator[bytes]:
        """Yield the bytes that have come, piece by piece, at most 64 KiB of them."""
        for _ in range(MOST // PIECE):
            try:
                found = os.read(self._file, PIECE)
            except BlockingIOError:
                return
            except OSError:  # the other end of a pty is closed, or an adapter is gone
                return
            if not found:
                return
            yield found

    def close(self) -> None:
        """Give the port back."""
        self._port.close()


def _words(error: Exception) -> str:
    cause = error.__context__ if isinstance(error.__context__, OSError) else error
    return reason(cause) if isinstance(cause, OSError) and cause.errno else str(error)
