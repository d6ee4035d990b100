"""yamspy, which we did not write, without its port: what it sends, and what it reads."""

from __future__ import annotations

import logging
from typing import Any
from unittest import mock

from yamspy import MSPy


class Connection:
    """What yamspy has in the place of a serial port."""

    def __init__(self, waiting: bytes = b"") -> None:
        self.sent, self.waiting = b"", waiting

    def write(self, data: bytes) -> int:
        self.sent += bytes(data)
        return len(data)

    def read(self, count: int = 1) -> bytes:
        found, self.waiting = self.waiting[:count], self.waiting[count:]
        return found


def yamspy(waiting: bytes = b"") -> Any:
    """Return a yamspy at a connection from which some bytes have come."""
    with mock.patch.object(logging, "basicConfig"):
        made = MSPy("nowhere", logfilename=None, loglevel="ERROR")
    made.conn, made.INAV = Connection(waiting), False
    return made


def read_by_yamspy(data: bytes) -> Any:
    """Return a yamspy that has read a message; AssertionError if it refuses it."""
    made = yamspy(data)
    found = made.receive_msg()
    assert made.process_recv_data(found) >= 0, found
    return made
