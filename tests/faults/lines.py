"""Serial lines through the test: pairs of ptys whose bytes take their time, and are spoilt on the way."""

from __future__ import annotations

import os
import select
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from typing import NamedTuple

from quadvis.machine.serial_port import Line, set_line
from quadvis.realtime.cables import Lane
from tests.damage import Damage

ROOM = 4096  # bytes at one reading
GOOD, STALLED = "good", "stalled"  # kinds of phases without damage
ABOVE = 90  # priority of the thread that carries the bytes
LOOK = 0.2  # s without a byte on any line, after which the end is looked for


class Phase(NamedTuple):
    """A stretch of a line: the kind of its damage, and the number of bytes that had been sent before it."""

    kind: str
    begin: int


class BadLine:
    """A line from the port ``near`` to the port ``far``, good until it has a damage.

    ``sent`` has all bytes that came to it, ``arrivals`` how many had come by which instant (ns), ``passed``
    those that it let through, ``phases`` what became of them. While it is stalled none come out, and
    afterwards all at once.
    """

    def __init__(self, line: Line) -> None:
        self._peers, self._ports = zip(*(os.openpty() for _ in range(2)), strict=True)
        for peer, port in zip(self._peers, self._ports, strict=True):
            set_line(port, line)
            os.set_blocking(peer, False)
        self.near, self.far = map(os.ttyname, self._ports)
        self.sent, self.passed = bytearray(), bytearray()
        self.arrivals: list[tuple[int, int]] = []
        self.phases = [Phase(GOOD, 0)]
        self._damage: Damage | None = None
        self._turning = threading.Lock()
        self._lane = Lane(line)
        self._ready = bytearray()  # what has come through

    @property
    def source(self) -> int:
        """What becomes readable when bytes come."""
        return self._peers[0]

    def next(self, now: int) -> int | None:
        """Return the instant at which bytes come through (ns); None if none are on their way."""
        return self._lane.next(now)

    def turn(self, kind: str = GOOD, damage: Damage | None = None) -> None:
        """Spoil the bytes that come from now on, or do so no longer."""
        with self._turning:
            self.phases.append(Phase(kind, len(self.sent)))
            self._damage = damage

    def carry(self, now: int) -> None:
        """Take what has come, and hand on what has come through (ns)."""
        with self._turning, suppress(BlockingIOError):
            piece = os.read(self.source, ROOM)
            self.sent += piece
            self.arrivals.append((time.monotonic_ns(), len(self.sent)))
            piece = piece if self._damage is None else self._damage(piece)
            self.passed += piece
            if piece:
                self._lane.put(now, piece)
        self._ready += self._lane.take(now)
        if self._ready and self.phases[-1].kind != STALLED:
            with suppress(BlockingIOError):
                del self._ready[: os.write(self._peers[1], self._ready)]

    def close(self) -> None:
        """Take the line away."""
        for end in (*self._peers, *self._ports):
            os.close(end)


class Lines:
    """Carries the bytes of lines by a thread of its own, until the end of the context."""

    def __init__(self, lines: Iterable[BadLine]) -> None:
        self._lines = tuple(lines)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Lines:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        for line in self._lines:
            line.close()

    def _run(self) -> None:
        with suppress(OSError):  # as the cables of a run, where it may: bytes are not to wait for programs
            os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(ABOVE))
        while not self._ended.is_set():
            now = time.monotonic_ns()
            due = [at for line in self._lines if (at := line.next(now)) is not None]
            timeout = max(0.0, (min(due) - now) / 1e9) if due else LOOK
            select.select([line.source for line in self._lines], [], [], timeout)
            for line in self._lines:
                line.carry(time.monotonic_ns())
