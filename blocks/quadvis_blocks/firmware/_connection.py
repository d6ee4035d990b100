"""The configuration port of Betaflight's software in the loop: MSP, or its command line, over TCP."""

from __future__ import annotations

import socket
from contextlib import suppress

from quadvis.errors import QuadvisError
from quadvis_blocks.hardware._msp import ANSWER, REFUSAL, V1, MspMessage, encode, take

CHUNK = 1 << 16  # bytes


class FirmwareError(QuadvisError):
    """Firmware that does not start, does not answer, or refuses."""


class MspConnection:
    """A connection to the configuration port; FirmwareError if it is closed from the other side."""

    def __init__(self, host: str, port: int, patience: float) -> None:
        self._socket = socket.create_connection((host, port), patience)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._received, self._unsent = bytearray(), b""

    def send(self, command: int, payload: bytes = b"") -> None:
        """Send a command without waiting; one for which there is no room now is not sent."""
        if not self._unsent:
            self._unsent = encode(command, payload, version=V1)
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

    def answers(self, patience: float = 0.0) -> list[MspMessage]:
        """Return the answers that have come, after a wait of ``patience`` (s) at most; damage is dropped."""
        self._received += self.read(patience)
        found = [message for message in take(self._received) if message is not None]
        return [message for message in found if message.direction in (ANSWER, REFUSAL)]

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
