"""The deadlines of ticks on one grid of the monotonic clock, and the tasks that are due at each."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

from quadvis.graph.graph import Graph

NANOSECONDS = 10**9


class Rhythm(NamedTuple):
    """The ticks at which a task is due: ``offset``, and then every ``every`` ticks."""

    every: int
    offset: int = 0


class Schedule:
    """Tick k is due k periods after the start, in whole nanoseconds, rounded down; nothing moves this grid.

    ``period`` is that of the base tick (s), ``rhythms`` are those of the tasks. Instants are nanoseconds
    since the start.
    """

    def __init__(self, period: Fraction, rhythms: Sequence[Rhythm]) -> None:
        self.rhythms = tuple(rhythms)
        self.numerator, self.denominator = (period * NANOSECONDS).as_integer_ratio()

    @staticmethod
    def of(graph: Graph) -> Schedule:
        """Return the schedule of a graph's tasks, in their order."""
        return Schedule(
            graph.tick,
            [Rhythm(graph.ticks(task.period), graph.ticks(task.offset)) for task in graph.tasks],
        )

    def deadline(self, tick: int) -> int:
        """Return the instant at which a tick is due."""
        return tick * self.numerator // self.denominator

    @property
    def interval(self) -> int:
        """The shortest period of a task (ns)."""
        return min(self.deadline(rhythm.every) for rhythm in self.rhythms)
