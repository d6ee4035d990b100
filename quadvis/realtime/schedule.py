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

    def first(self, tick: int) -> int:
        """Return its first tick from ``tick`` on."""
        return tick + max(self.offset - tick, (self.offset - tick) % self.every)

    def last(self, tick: int) -> int:
        """Return its last tick up to ``tick``; -1 if there is none."""
        return tick - (tick - self.offset) % self.every if tick >= self.offset else -1

    def due_in(self, start: int, stop: int) -> int:
        """Return how many of its ticks lie in ``range(start, stop)``."""
        return self._before(stop) - self._before(start)

    def _before(self, tick: int) -> int:
        return max(0, -((self.offset - tick) // self.every))


class Schedule:
    """Tick k is due k periods after the start, in whole nanoseconds, rounded down; nothing moves this grid.

    ``period`` is that of the base tick (s), ``rhythms`` are those of the tasks. Instants are nanoseconds
    since the start.
    """

    def __init__(self, period: Fraction, rhythms: Sequence[Rhythm]) -> None:
        self.rhythms = tuple(rhythms)
        self._numerator, self._denominator = (period * NANOSECONDS).as_integer_ratio()

    @staticmethod
    def of(graph: Graph) -> Schedule:
        """Return the schedule of a graph's tasks, in their order."""
        return Schedule(
            graph.tick,
            [Rhythm(graph.ticks(task.period), graph.ticks(task.offset)) for task in graph.tasks],
        )

    def deadline(self, tick: int) -> int:
        """Return the instant at which a tick is due."""
        return tick * self._numerator // self._denominator

    def next(self, tick: int, instant: int) -> int:
        """Return the first tick with a due task, from ``tick`` on and due no earlier than an instant."""
        if self.deadline(tick) < instant:
            tick = -(-instant * self._denominator // self._numerator)
        return min([rhythm.first(tick) for rhythm in self.rhythms])

    def latest(self, instant: int) -> int:
        """Return the last tick with a due task that is due up to an instant; -1 if there is none."""
        tick = ((instant + 1) * self._denominator - 1) // self._numerator
        return max([rhythm.last(tick) for rhythm in self.rhythms])

    @property
    def interval(self) -> int:
        """The shortest period of a task (ns)."""
        return min(self.deadline(rhythm.every) for rhythm in self.rhythms)
