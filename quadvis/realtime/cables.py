"""Cables: pairs of ptys whose bytes take the time that a serial line would need.

A pty hands bytes on at once, whatever its baud rate. The process of the cables joins two of them, and lets
each byte through when its last bit would have come, in both directions.
"""

from __future__ import annotations

import os
import select
import signal
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple

from quadvis.errors import RunError
from quadvis.machine.interrupts import leave_to_parent
from quadvis.machine.processes import launching
from quadvis.machine.serial_port import Line, set_line
from quadvis.realtime.lives import Lives
from quadvis.realtime.options import RealTime
from quadvis.realtime.schedule import NANOSECONDS
from quadvis.realtime.system import ask_all

ROOM = 4096  # bytes on their way in one direction; then the sender waits
GRAIN = 500_000  # ns: bytes are handed on in pieces that take about as long, the last ones at their own time
START = 30.0  # s that the process has to make the cables


class Cable(NamedTuple):
    """A cable to be made: the line whose times its bytes take."""

    name: str
    line: Line


class Ends(NamedTuple):
    """The paths of the two ends of a cable; output devices take the first one, input devices the second."""

    a: str
    b: str


class Lane:
    """One direction of a cable: bytes go in, and come out at the instants (ns) of a line."""

    def __init__(self, line: Line) -> None:
        self._byte = int(NANOSECONDS * line.time(1))
        self._waiting: deque[tuple[int, bytes]] = deque()  # with the instants at which they begin
        self._free = 0  # the instant at which the line has sent all
        self.count = 0

    def put(self, now: int, piece: bytes) -> None:
        """Put bytes in; they begin once the bytes before them are through."""
        begin = max(now, self._free)
        self._waiting.append((begin, piece))
        self._free = begin + len(piece) * self._byte
        self.count += len(piece)

    def take(self, now: int) -> bytes:
        """Return the bytes that have come through."""
        found = []
        while self._waiting:
            begin, piece = self._waiting[0]
            through = min(len(piece), (now - begin) // self._byte)
            if through <= 0:
                break
            found.append(piece[:through])
            self._waiting.popleft()
            if through < len(piece):
                self._waiting.appendleft((begin + through * self._byte, piece[through:]))
                break
        taken = b"".join(found)
        self.count -= len(taken)
        return taken

    def next(self, now: int) -> int | None:
        """Return the instant at which the next bytes should be taken; None if there are none."""
        if not self._waiting:
            return None
        return max(self._waiting[0][0] + self._byte, min(self._free, now + GRAIN))


@dataclass(frozen=True)
class CablesSetup:
    """What the process of the cables needs; ``priority`` is that of the loops (0: none)."""

    cables: tuple[Cable, ...]
    link: Connection
    supervisor: int
    priority: int


class Cables:
    """The process of the cables, as the supervisor has it.

    ``ends`` are there after `make`. It ends when it is told to, or when neither the supervisor nor any
    watched process lives. Without cables there is no process.
    """

    def __init__(self, context: SpawnContext, cables: Sequence[Cable], priority: int) -> None:
        self._cables = tuple(cables)
        self._link, self._theirs = context.Pipe()
        setup = CablesSetup(self._cables, self._theirs, os.getpid(), priority)
        self.process: BaseProcess = context.Process(target=carry, args=(setup,), name="cables")
        self.ends: dict[str, Ends] = {}

    def start(self) -> None:
        """Start the process."""
        if self._cables:
            with launching():
                self.process.start()
            self._theirs.close()

    def make(self) -> None:
        """Wait until the cables are made; RunError if they cannot be."""
        if not self._cables:
            return
        try:
            made = self._link.recv() if self._link.poll(START) else None
        except (EOFError, OSError):
            made = None
        if made is None:
            raise RunError("the cables of ptys could not be made")
        self.ends = {cable.name: Ends(*paths) for cable, paths in zip(self._cables, made, strict=True)}

    def watch(self, process: int) -> None:
        """Let it go on as long as this process lives."""
        if not self._cables:
            return
        with suppress(OSError):
            self._link.send(process)

    def close(self) -> None:
        """End it."""
        if self.process.pid is not None:
            self.process.terminate()
            self.process.join()


class _Side(NamedTuple):
    """A pty, its other end held open, and the lane that takes its bytes away."""

    master: int
    slave: int
    lane: Lane


def carry(setup: CablesSetup) -> None:
    """Make the cables and carry their bytes: the whole life of the process."""
    os.setsid()
    leave_to_parent()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    pairs = [(_side(cable.line), _side(cable.line)) for cable in setup.cables]
    lives = Lives()
    lives.watch(setup.supervisor)
    setup.link.send([(os.ttyname(one.slave), os.ttyname(other.slave)) for one, other in pairs])
    ask_all(RealTime(priority=setup.priority))
    ways = [way for one, other in pairs for way in ((one, other), (other, one))]
    listening = [setup.link]
    while not lives.all_ended:
        _step(ways, lives, listening)
        lives.look()


def _side(line: Line) -> _Side:
    master, slave = os.openpty()
    set_line(slave, line)
    os.set_blocking(master, False)
    return _Side(master, slave, Lane(line))


def _step(ways: Sequence[tuple[_Side, _Side]], lives: Lives, listening: list[Connection]) -> None:
    """Wait until something is due or has come, and carry it on."""
    now = time.monotonic_ns()
    due = [at for side, _ in ways if (at := side.lane.next(now)) is not None]
    timeout = max(0, min(due) - now) / NANOSECONDS if due else None
    open_ways = [side.master for side, _ in ways if side.lane.count < ROOM]
    sources: list[Any] = [*open_ways, *lives.descriptors, *listening]
    ready = select.select(sources, [], [], timeout)[0]
    for link in [link for link in listening if link in ready]:
        try:
            lives.watch(link.recv())
        except (EOFError, OSError):
            listening.remove(link)
    now = time.monotonic_ns()
    for side, other in ways:
        if side.master in ready:
            with suppress(BlockingIOError):
                side.lane.put(now, os.read(side.master, ROOM))
        through = side.lane.take(now)
        if through:
            with suppress(BlockingIOError):  # nobody reads at the other end: as on a wire, they are gone
                os.write(other.master, through)
