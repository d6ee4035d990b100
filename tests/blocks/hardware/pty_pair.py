"""A pty whose bytes have arrived when a call returns: the system hands them on when it finds the time."""

from __future__ import annotations

import fcntl
import os
import select
import struct
import termios
import time
from contextlib import suppress

PATIENCE = 5.0  # s
SILENCE = 0.02  # s after which nothing more is on its way


def put(peer: int, port: int, data: bytes) -> None:
    """Write bytes to the peer's end, and wait until they can be read at the port."""
    if not data:
        return
    before = _waiting(port)
    os.write(peer, data)
    until = time.monotonic() + PATIENCE
    while _waiting(port) < before + len(data) and time.monotonic() < until:
        time.sleep(1e-4)


def filled(peer: int, port: int, data: bytes) -> int:
    """Write bytes until the pty takes no more and all that it took has arrived; return how many it took.

    The peer's end must not wait.
    """
    written, moved = 0, time.monotonic()
    arrived = _waiting(port)
    while written < len(data) and time.monotonic() - moved < 10 * SILENCE:
        with suppress(BlockingIOError):
            written += os.write(peer, data[written:])
            moved = time.monotonic()
        if (now := _waiting(port)) != arrived:
            arrived, moved = now, time.monotonic()
        time.sleep(1e-3)
    return written


def heard(peer: int, count: int = 0) -> bytes:
    """Return what has come to the peer's end: so many bytes at least, if they come, and all after them."""
    found, until = b"", time.monotonic() + PATIENCE
    while True:
        missing = len(found) < count and time.monotonic() < until
        if not select.select([peer], [], [], PATIENCE if missing else SILENCE)[0]:
            return found
        found += os.read(peer, 1 << 16)


def _waiting(port: int) -> int:
    return int(struct.unpack("i", fcntl.ioctl(port, termios.FIONREAD, bytes(4)))[0])
