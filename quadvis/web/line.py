"""The way to one page: what can be sent at once goes as frames of the websocket, in one write."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, Protocol

SHORT, LONG = 126, 1 << 16  # bytes from which on a length takes 2 and 8 bytes more, see RFC 6455, 5.2


class PageLine(Protocol):
    """What a viewer needs of its connection."""

    def free(self) -> bool:
        """Whether a message would be on its way at once."""

    def write(self, messages: Sequence[str | bytes]) -> None:
        """Send messages of a line that is free."""

    async def send(self, message: str | bytes) -> None:
        """Send a message, and wait until there is room for the next one."""

    def cut(self) -> None:
        """End the connection at once."""


class DirectLine:
    """A connection of the server of `websockets`, which has no extensions and sends whole messages.

    `write` costs a tenth of `send`: no task has to be woken, and several messages are one call of the system.
    """

    def __init__(self, socket: Any) -> None:
        from websockets.protocol import State

        self._socket, self._open = socket, State.OPEN
        self.send, self.cut = socket.send, socket.transport.abort

    def free(self) -> bool:
        """Whether a message would be on its way at once."""
        socket = self._socket
        return socket.state is self._open and not socket.transport.get_write_buffer_size()

    def write(self, messages: Sequence[str | bytes]) -> None:
        """Send messages of a line that is free."""
        self._socket.transport.write(b"".join(map(framed, messages)))


def framed(message: str | bytes) -> bytes:
    """Return a message as one frame of a server: a text or bytes."""
    kind, data = (0x81, message.encode()) if isinstance(message, str) else (0x82, message)
    size = len(data)
    if size < SHORT:
        return bytes((kind, size)) + data
    if size < LONG:
        return struct.pack(">BBH", kind, 126, size) + data
    return struct.pack(">BBQ", kind, 127, size) + data
