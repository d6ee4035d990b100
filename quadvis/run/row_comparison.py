"""Rows of a replay compared with those of its log, as they come."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.taps import Tap
from quadvis.output.comparison import BlockComparison, SignalDifference
from quadvis.output.log_reader import Log
from quadvis.output.recording import SLOT, Slots
from quadvis.output.stretch import stamps_of
from quadvis.run.recorded_run import RecordedPart, check_ports
from quadvis.run.rows import RecordedNode

Whole = NDArray[np.int64]
MISSING = -1
PIECE = 1 << 14  # bytes of rows that are compared together


@dataclass(frozen=True)
class FoundDifference:
    """A signal that differs between a log and its replay, and the tick of the first row that does."""

    difference: SignalDifference
    tick: int


@dataclass(frozen=True)
class Lack:
    """Rows of a block that only the log has, or only the replay: their count, and the first stamp (ns)."""

    path: str
    count: int
    stamp: int
    only_in_log: bool


class RowComparison(Tap):
    """Compares the rows of a block with those that a log has for the same ticks."""

    def __init__(self, log: Log, part: RecordedPart, recorded: RecordedNode, end: int) -> None:
        """Begin, with the rows of ``log`` for the ticks before ``end``."""
        self.block, self.every, self.ports = recorded.node.path, recorded.every, recorded.block.ports
        topic = recorded.block.path
        there = log.block(topic)
        if there is not None:
            check_ports(log, there, recorded.node)
            self._stamps, self._old = log.arrays(topic)
        else:
            self._stamps, self._old = (
                np.zeros(0, np.int64),
                np.zeros((0, recorded.block.size // SLOT), np.int64),
            )
        self._ticks = part.ticks_of(self.block, self.every, end)
        self._wanted = stamps_of(self._ticks, part.graph.tick)
        self._places = _places(self._stamps, self._wanted)
        self._next = 0
        self._waiting = bytearray()
        self._comparison = BlockComparison(recorded.block)

    @property
    def rows(self) -> int:
        """How many rows were compared."""
        self._flush()
        return self._comparison.rows

    def take(self, tick: int, row: memoryview) -> None:
        """Compare the next row, together with others that follow."""
        self._waiting += row
        if len(self._waiting) >= PIECE:
            self._flush()

    def take_all(self, ticks: Whole, rows: Slots) -> None:
        """Compare the next rows."""
        self._flush()
        self._compare(rows)

    def _flush(self) -> None:
        """Compare the rows that wait."""
        if self._waiting:
            self._compare(np.frombuffer(bytes(self._waiting), np.int64).reshape(-1, self._old.shape[1]))
            self._waiting.clear()

    def _compare(self, rows: Slots) -> None:
        places = self._places[self._next : self._next + len(rows)]
        self._next += len(rows)
        there = places != MISSING
        self._comparison.compare(self._old[places[there]], rows[there])

    def found(self) -> list[FoundDifference]:
        """Return the signals that differ."""
        self._flush()
        ticks = self._ticks[self._places != MISSING]
        return [FoundDifference(each, int(ticks[each.row])) for each in self._comparison.differences()]

    def lacks(self) -> list[Lack]:
        """Return the rows that only one of the two has."""
        new = self._wanted[self._places == MISSING]
        old = np.delete(self._stamps, self._places[self._places != MISSING])
        return [
            Lack(self.block, len(stamps), int(stamps[0]), only_in_log)
            for stamps, only_in_log in ((new, False), (old, True))
            if len(stamps)
        ]


def _places(stamps: Whole, wanted: Whole) -> Whole:
    """Return for each wanted stamp the number of the row that has it, or ``MISSING``.

    Rows keep their order where stamps are equal: the n-th row belongs to the n-th tick.
    """
    count = min(len(stamps), len(wanted))
    if (stamps[:count] == wanted[:count]).all():
        return np.where(np.arange(len(wanted)) < count, np.arange(len(wanted)), MISSING)
    order = np.argsort(stamps, kind="stable")
    near = order[np.minimum(np.searchsorted(stamps[order], wanted), len(stamps) - 1)]
    return np.where(stamps[near] == wanted, near, MISSING)
