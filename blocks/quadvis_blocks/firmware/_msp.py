"""MSP version 1, by which Betaflight is asked and told: `$M`, direction, length, command, payload, checksum.

The checksum is the exclusive or of length, command and payload. See Betaflight's ``src/main/msp``.
"""

from __future__ import annotations

import functools
import operator
import socket
from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

from quadvis.errors import QuadvisError

API_VERSION, VARIANT, VERSION = 1, 2, 3
MODE_RANGES, BOX_IDS, STATUS_EX, SET_RAW_RC = 34, 119, 150, 200
TO, FROM, REFUSED = b"<", b">", b"!"
HEAD = 5  # bytes before the payload
MOST = 255  # bytes of a payload
KEPT = 1 << 16  # bytes at most that wait for the rest of their frame
CHUNK = 1 << 16


class FirmwareError(QuadvisError):
    """Firmware that does not start, does not answer, or refuses."""


class Reply(NamedTuple):
    """What the firmware says to a command."""

    command: int
    payload: bytes
    refused: bool = False


def request(command: int, payload: bytes = b"", direction: bytes = TO) -> bytes:
    """Return the frame of a command; ValueError if the payload is too long."""
    if len(payload) > MOST:
        raise ValueError(f"a payload has at most {MOST} bytes, not {len(payload)}")
    body = bytes([len(payload), command]) + payload
    return b"$M" + direction + body + bytes([checksum(body)])


def checksum(body: bytes) -> int:
    """Return the checksum of length, command and payload."""
    return functools.reduce(operator.xor, body, 0)


def replies(received: bytearray) -> Iterator[Reply]:
    """Take all whole frames of the firmware off the beginning; damaged ones and other bytes are dropped."""
    while True:
        begin = received.find(b"$M")
        if begin < 0:
            del received[: -1 if received[-1:] == b"$" else len(received)]
            return
        del received[:begin]
        if len(received) < HEAD:
            return
        length = received[3]
        if len(received) < HEAD + length + 1:
            return
        direction, body = bytes(received[2:3]), bytes(received[3 : HEAD + length])
        if direction not in (FROM, REFUSED) or checksum(body) != received[HEAD + length]:
            del received[:2]
            continue
        del received[: HEAD + length + 1]
        yield Reply(body[1], body[2:], direction == REFUSED)


class MspConnection:
    """A connection to the configuration port; FirmwareError if it is closed from the other side."""

    def __init__(self, host: str, port: int, patience: float) -> None:
        self._socket = socket.create_connection((host, port), patience)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._received, self._unsent = bytearray(), b""

    def send(self, command: int, payload: bytes = b"") -> None:
        """Send a command without waiting; one for which there is no room now is not sent."""
        if not self._unsent:
            self._unsent = request(command, payload)
        self._flush()

    def write(self, text: bytes) -> None:
        """Send other bytes, for the command line."""
        self._socket.settimeout(1.0)
        try:
            self._socket.sendall(text)
        except OSError as error:
            raise FirmwareError("its configuration port takes no bytes") from error

    def read(self, patience: float = 0.0) -> bytes:
        """Return the bytes that have come, after a wait of ``patience`` (s) at most."""
        self._socket.settimeout(patience)
        try:
            found = self._socket.recv(CHUNK)
        except (TimeoutError, BlockingIOError):
            return b""
        except OSError:
            found = b""
        if not found:
            raise FirmwareError("it has closed its configuration port")
        return found

    def replies(self, patience: float = 0.0) -> list[Reply]:
        """Return the replies that have come, after a wait of ``patience`` (s) at most."""
        self._received += self.read(patience)
        found = list(replies(self._received))
        del self._received[:-KEPT]
        return found

    def close(self) -> None:
        """Close it."""
        with suppress(OSError):
            self._socket.close()

    def _flush(self) -> None:
        self._socket.settimeout(0.0)
        try:
            count = self._socket.send(self._unsent)
        except BlockingIOError:
            return
        except OSError as error:
            raise FirmwareError("it has closed its configuration port") from error
        self._unsent = self._unsent[count:]
