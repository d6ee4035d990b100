"""Streams: the rows of several blocks on their way from the loop to those who take them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from typing import NamedTuple

from quadvis.engine.engine import Engine
from quadvis.engine.taps import MachineCall, Tap
from quadvis.graph.graph import Graph, Node
from quadvis.realtime.ring import PUTTING, RecordRing, Words

HELD = 2.0  # s of rows for which there is room
SPARE = 16  # records besides
StreamTaps = Sequence[Sequence[Tap]]  # those of each block of a stream


def nothing() -> None:
    """Do nothing."""


class RowStream(NamedTuple):
    """The blocks of a task whose rows are taken at the same ticks; their rows lie side by side in a record.

    ``every`` counts the task's own ticks, ``sizes`` the slots of each row. ``room`` is the number of records
    that may wait.
    """

    task: str
    every: int
    blocks: tuple[str, ...]
    sizes: tuple[int, ...]
    room: int

    @property
    def ring(self) -> tuple[int, int]:
        """The room and the width of its ring: a record is a tick and the rows."""
        return self.room, 1 + sum(self.sizes)

    def put_into(self, ring: RecordRing, engine: Engine, native: bool = False) -> None:
        """Let an engine put the rows of its ticks into a ring; without Python if it is ``native``."""
        pieces = _joined([engine.program[path].row for path in self.blocks])
        machine = None
        if native:
            from quadvis.native.library import library

            places = ring.machine(engine.memory.floats.ctypes.data, pieces)
            machine = MachineCall(library().routine(PUTTING), places, ring)
        engine.observe(self.task, partial(_put, ring, engine.memory.raw, pieces), self.every, machine)

    def hand_on(self, records: Words, taps: StreamTaps, between: Callable[[], None] = nothing) -> None:
        """Give the rows in records to the taps of each of its blocks; ``between`` is called after each."""
        if not len(records):
            return
        start, ticks = 1, records[:, 0].copy()
        for own, size in zip(taps, self.sizes, strict=True):
            rows = records[:, start : start + size].copy()
            for tap in own:
                tap.take_all(ticks, rows)
            start += size
            between()


def streams_of(graph: Graph, taps: Sequence[Tap]) -> list[tuple[RowStream, StreamTaps]]:
    """Return the streams that taps need, each with the taps of its blocks.

    A stream has a block once, however many taps take its rows.
    """
    groups: dict[tuple[str, int], dict[str, list[Tap]]] = {}
    for tap in taps:
        group = groups.setdefault((graph[tap.block].task.name, tap.every), {})
        group.setdefault(tap.block, []).append(tap)
    found: list[tuple[RowStream, StreamTaps]] = []
    for (task, every), group in groups.items():
        nodes = [graph[block] for block in group]
        room = room_for(nodes[0].task.period * every)
        sizes = tuple(map(_row_size, nodes))
        found.append((RowStream(task, every, tuple(group), sizes, room), list(group.values())))
    return found


def room_for(period: Fraction) -> int:
    """Return how many records may wait that come once in a period (s)."""
    return math.ceil(HELD / period) + SPARE


def _put(ring: RecordRing, raw: memoryview, pieces: Sequence[slice], tick: int) -> None:
    ring.put(tick, raw, pieces)


def _joined(rows: Sequence[slice]) -> list[slice]:
    """Return the same bytes in fewer pieces: neighbours in memory are one."""
    found = list(rows[:1])
    for row in rows[1:]:
        if row.start == found[-1].stop:
            found[-1] = slice(found[-1].start, row.stop)
        else:
            found.append(row)
    return found


def _row_size(node: Node) -> int:
    """Return the slots of a block's row."""
    outputs = node.block.interface.outputs.items()
    return sum(math.prod(node.shape(name)) for name, port in outputs if port.signal.scalar != "frame")
