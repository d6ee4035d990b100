"""What waits to be sent on a ROUTER socket, for each connection by itself, so that nobody holds up another.

libzmq holds few messages for a connection. Further ones wait here, up to a number of bytes; then the oldest
of them are dropped and counted. Sending never waits.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from typing import Any

import zmq

from quadvis.wire.limits import LAG


class Outbox:
    """The queues of one ROUTER socket, which says whether a connection still exists (ROUTER_MANDATORY)."""

    def __init__(self, socket: zmq.Socket[Any], lag: int = LAG) -> None:
        self._socket, self._lag = socket, lag
        self._waiting: dict[bytes, deque[tuple[Sequence[bytes], int]]] = {}
        self._bytes: Counter[bytes] = Counter()
        self.dropped: Counter[bytes] = Counter()  # by connection, as long as there is one
        self.all_dropped = 0
        self.moves = False  # whether `flush` has sent something when it was called last

    @property
    def waits(self) -> bool:
        """Whether anything waits."""
        return bool(self._waiting)

    def send(self, identity: bytes, frames: Sequence[bytes]) -> bool:
        """Send a message, or let it wait; return False if the connection is gone."""
        if identity not in self._waiting:
            sent = self._try(identity, frames)
            if sent is not None:
                return sent
        size = sum(map(len, frames))
        waiting = self._waiting.setdefault(identity, deque())
        waiting.append((frames, size))
        self._bytes[identity] += size
        while self._bytes[identity] > self._lag and len(waiting) > 1:
            self._bytes[identity] -= waiting.popleft()[1]
            self.dropped[identity] += 1
            self.all_dropped += 1
        return True

    def flush(self) -> list[bytes]:
        """Send what can be sent now; return the connections that are gone."""
        gone = []
        self.moves = False
        for identity, waiting in list(self._waiting.items()):
            sent: bool | None = True
            while waiting and sent:
                sent = self._try(identity, waiting[0][0])
                if sent:
                    self.moves = True
                    self._bytes[identity] -= waiting.popleft()[1]
            if sent is False:
                gone.append(identity)
                self.forget(identity)
            elif not waiting:
                del self._waiting[identity], self._bytes[identity]
        return gone

    def forget(self, identity: bytes) -> None:
        """Drop all that waits for a connection."""
        self._waiting.pop(identity, None)
        self._bytes.pop(identity, None)
        self.dropped.pop(identity, None)

    def _try(self, identity: bytes, frames: Sequence[bytes]) -> bool | None:
        """Return True if a message is on its way, None if it must wait, False if nobody is there."""
        try:
            self._socket.send_multipart([identity, *frames], zmq.NOBLOCK)
        except zmq.Again:
            return None
        except zmq.ZMQError:
            return False
        return True
