"""Whole messages between two processes of this computer, over a pair of sockets; nobody waits.

A message is a list of plain values as msgpack, which says by itself where it ends.
"""

from __future__ import annotations

import socket
from collections import deque
from itertools import islice
from typing import Any

import msgpack

_CHUNK = 1 << 16  # bytes that are read at once
_AT_ONCE = 64  # messages that are handed to the system at once


class Pipe:
    """One end: `put` and `flush` send, `take` receives messages of at most ``longest`` bytes."""

    def __init__(self, end: socket.socket, longest: int) -> None:
        self._end = end
        end.setblocking(False)
        self._unpacker = msgpack.Unpacker(raw=False, max_buffer_size=longest + _CHUNK)
        self._packer = msgpack.Packer()
        self._outgoing: deque[memoryview] = deque()
        self.waiting = 0  # bytes that were put and not sent yet

    def fileno(self) -> int:
        """Return the descriptor, which can be read when there is a message."""
        return self._end.fileno()

    def put(self, *message: Any) -> None:
        """Let a message wait until `flush`."""
        data = memoryview(self._packer.pack(message))
        self._outgoing.append(data)
        self.waiting += len(data)

    def flush(self) -> None:
        """Send what can be sent now; if nobody is there, it is dropped, and `take` says so."""
        while self._outgoing:
            try:
                sent = self._end.sendmsg(list(islice(self._outgoing, _AT_ONCE)))
            except BlockingIOError:
                return
            except OSError:
                self._outgoing.clear()
                self.waiting = 0
                return
            self.waiting -= sent
            while self._outgoing and sent >= len(self._outgoing[0]):
                sent -= len(self._outgoing.popleft())
            if sent:
                self._outgoing[0] = self._outgoing[0][sent:]

    def take(self) -> list[Any] | None:
        """Return the next message, None if there is none now; EOFError if the other end is closed.

        The same error is for what is no message, or one that is too long: no further one can be found.
        """
        try:
            while True:
                try:
                    found = self._unpacker.unpack()
                except msgpack.OutOfData:
                    data = self._end.recv(_CHUNK)
                    if not data:
                        raise EOFError from None
                    self._unpacker.feed(data)
                    continue
                if not isinstance(found, list) or not found:
                    raise EOFError
                return found
        except BlockingIOError:
            return None
        except (OSError, ValueError, msgpack.UnpackException):
            raise EOFError from None

    def end(self) -> None:
        """Say that no more will come; what has been sent arrives before."""
        try:
            self._end.shutdown(socket.SHUT_WR)
        except OSError:
            return

    def close(self) -> None:
        """Close this end."""
        self._end.close()
