"""Ptys in the place of serial ports, and what has come to their peers."""

from __future__ import annotations

import os
import select
from collections.abc import Iterator
from contextlib import contextmanager

from quadvis.machine.serial_port import BACKLOG, unread
from tests.processes import wait_for


class Pty:
    """A pty: ``path`` is the port, and this end is its peer."""

    def __init__(self) -> None:
        self.peer, self._port = os.openpty()
        self.path = os.ttyname(self._port)
        self.wire = bytearray()

    def read(self) -> bytes:
        """Return all that has ever come."""
        while self.peer >= 0 and select.select([self.peer], [], [], 0)[0]:
            self.wire += os.read(self.peer, 1 << 16)
        return bytes(self.wire)

    def wait_for(self, frame: bytes) -> None:
        """Wait until the newest bytes are a frame, twice."""
        wait_for(lambda: self.read().endswith(2 * frame))

    def unplug(self) -> None:
        """Take the peer away: the port is gone."""
        os.close(self.peer)
        self.peer = -1

    def close(self) -> None:
        """Take both ends away."""
        if self.peer >= 0:
            self.unplug()
        os.close(self._port)


def arrive(peer: int, port: int, data: bytes) -> None:
    """Send bytes from the peer of a pty, and wait until a reader of the port need not wait for them."""
    there = unread(port)
    os.write(peer, data)
    wait_for(lambda: unread(port) >= min(there + len(data), BACKLOG), pause=1e-4)


@contextmanager
def ptys(count: int) -> Iterator[list[Pty]]:
    """Yield so many ptys."""
    made = [Pty() for _ in range(count)]
    try:
        yield made
    finally:
        for each in made:
            each.close()
