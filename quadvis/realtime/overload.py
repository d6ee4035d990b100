"""Overload: whether the overruns of a real-time run are more than its diagram allows."""

from __future__ import annotations

from collections.abc import Sequence

from quadvis.diagram.sections.overload import STOP, OverloadLimits
from quadvis.errors import counted


class OverloadWatch:
    """Counts the overruns of tasks against the limits of a diagram.

    An overrun is a tick of a task at which the task was due and did not run, because a step took too long
    or the loop woke too late. Each task has its own count, as each sub-rate in xPC Target. What one of the
    first steps of any task has caused does not count.
    """

    def __init__(self, tasks: Sequence[str], limits: OverloadLimits) -> None:
        self._tasks, self._limits = tasks, limits
        self._counted = [0] * len(tasks)
        self._in_a_row = [0] * len(tasks)
        self._starting = True

    def ran(self, tasks: Sequence[int], fewest: int) -> None:
        """Note a step of tasks: their overruns in a row end. ``fewest`` steps has one of them done so far."""
        for task in tasks:
            self._in_a_row[task] = 0
        self._starting = fewest <= self._limits.startup

    def missed(self, task: int, count: int) -> str:
        """Count overruns of a task after the last step; return the limit that stops the run, or ""."""
        limits = self._limits
        if self._starting:
            return ""
        self._counted[task] += count
        self._in_a_row[task] += count
        if limits.action != STOP:
            return ""
        name = f"task '{self._tasks[task]}'"
        if self._counted[task] > limits.max:
            found = counted(self._counted[task], "overrun")
            return f"{name}: overload limit ({limits.max}) exceeded with {found}"
        if limits.consecutive is not None and self._in_a_row[task] > limits.consecutive:
            found = counted(self._in_a_row[task], "overrun")
            return f"{name}: overload limit ({limits.consecutive} in a row) exceeded with {found} in a row"
        return ""
