"""The taps of a run: rows of a block, with their stamps, for the recording, the log and the verdicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.taps import Tap
from quadvis.graph.graph import Graph, Node
from quadvis.output.kept import RowJudge
from quadvis.output.stretch import NANOSECONDS, scaled

Whole = NDArray[np.int64]


@dataclass(frozen=True)
class Taker:
    """A consumer of a block's rows: ``one`` takes a stamp (ns) and a row, ``many`` those of N rows."""

    one: Callable[[int, bytes], object]
    many: Callable[[Whole, Whole], object]


class RowTap(Tap):
    """Hands the rows of a block with their stamps (ns) to all its consumers."""

    def __init__(
        self, block: str, every: int, period: Fraction, takers: Sequence[Taker], topic: str = ""
    ) -> None:
        self.block, self.every, self.topic = block, every, topic
        self._one = tuple(taker.one for taker in takers)
        self._many = tuple(taker.many for taker in takers)
        self._numerator, self._denominator = (period * NANOSECONDS).as_integer_ratio()

    def take(self, tick: int, row: memoryview) -> None:
        """Copy the row once for all."""
        data, stamp = bytes(row), tick * self._numerator // self._denominator
        for take in self._one:
            take(stamp, data)

    def take_all(self, ticks: Whole, rows: Whole) -> None:
        """Hand many rows on together."""
        stamps = scaled(ticks, self._numerator, self._denominator)
        for take in self._many:
            take(stamps, rows)


class PacedTap(Tap):
    """Hands the rows of a block in a real-time run on, and tells its judge of ticks that have none."""

    def __init__(self, tap: RowTap, node: Node, graph: Graph, judge: RowJudge) -> None:
        self.block, self.every, self.topic = tap.block, tap.every, tap.topic
        self._tap, self._judge = tap, judge
        self._first = graph.ticks(node.task.offset)
        self._spacing = graph.ticks(node.task.period) * tap.every
        self._next = 0  # the number of the next row, if none is missing

    def take(self, tick: int, row: memoryview) -> None:
        """Hand a row on."""
        self._reach(tick)
        self._tap.take(tick, row)
        self._next += 1

    def take_all(self, ticks: Whole, rows: Whole) -> None:
        """Hand many rows on, those without a gap between them together."""
        if len(ticks) and int(ticks[-1]) - int(ticks[0]) == self._spacing * (len(ticks) - 1):
            self._hand_on(ticks, rows)
            return
        gaps = np.flatnonzero(np.diff(ticks) != self._spacing) + 1
        for some, part in zip(np.split(ticks, gaps), np.split(rows, gaps), strict=True):
            self._hand_on(some, part)

    def _hand_on(self, ticks: Whole, rows: Whole) -> None:
        """Hand rows without a gap between them on."""
        self._reach(int(ticks[0]))
        self._tap.take_all(ticks, rows)
        self._next += len(ticks)

    def end(self, ticks: int) -> None:
        """Note which rows are missing at the end of a run of so many ticks."""
        self._reach(ticks + self._spacing - 1)

    def _reach(self, tick: int) -> None:
        """Note the rows that are missing before that of a tick."""
        number = (tick - self._first) // self._spacing
        if number > self._next:
            self._judge.miss(number - self._next)
            self._next = number
