"""Tasks that run each by itself, repeated as they ran: those that began late, and those that did not begin.

The tasks of a run in real time begin as its dispatcher decided. What one reads of others depends on these
decisions alone, not on when its step went on. So they can be repeated one after the other, in one thread.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.interpreter import Interpreter, Stop
from quadvis.engine.layout import TIME
from quadvis.graph.graph import Graph, Task
from quadvis.native.choice import Choice
from quadvis.native.task_executors import TaskExecutors

Whole = NDArray[np.int64]


def begins(graph: Graph, number: int, left_out: Whole, releases: Whole, end: int) -> Whole:
    """Return the ticks before ``end`` at which a task was due and began, and those at which it did (N, 2).

    It is not the fastest one. ``left_out`` are the ticks without a step of the fastest task, the first and
    the count of each run of ticks (M, 2). ``releases`` are what tasks missed, as the log has it (K, 4).
    """
    task: Task = graph.tasks[number]
    every, offset = graph.ticks(task.period), graph.ticks(task.offset)
    due = np.arange(offset, end, every, dtype=np.int64)
    begun = np.where(without(due, left_out), due, -1)
    for _, tick, count, late in releases[releases[:, 0] == number].tolist():
        place = (tick - offset) // every
        if place < 0 or count < 0:  # nonsense, from a damaged log
            continue
        begun[place : place + count] = -1
        if late >= 0 and place + count < len(due):
            begun[place + count] = late
    kept = (begun >= 0) & (begun < end)
    return np.stack((due[kept], begun[kept]), axis=1)


def without(ticks: Whole, left_out: Whole) -> NDArray[np.bool_]:
    """Return for each tick whether it is none of those that were left out."""
    if not len(left_out):
        return np.ones(len(ticks), np.bool_)
    place = np.searchsorted(left_out[:, 0], ticks, "right") - 1
    ran: NDArray[np.bool_] = (place < 0) | (ticks >= left_out[place].sum(axis=1))
    return ran


class PlayedTasks(TaskExecutors):
    """Runs the fastest task, and each other one at the ticks at which it began: an executor.

    ``begun`` has for each task but the fastest what `begins` gives.
    """

    def __init__(self, interpreter: Interpreter, choice: Choice, begun: Sequence[Whole]) -> None:
        super().__init__(interpreter, choice)
        tasks = interpreter.program.tasks[1:]
        self._due = [dict(zip(pairs[:, 1].tolist(), pairs[:, 0].tolist(), strict=True)) for pairs in begun]
        self._begins = sorted({tick for due in self._due for tick in due})
        self._delays = [[interpreter.call(op) for op in task.delays] for task in tasks]
        self._latches = [  # each part has its own time
            [interpreter.call(op) for op in task.latches if op.sources[0] != TIME] for task in tasks
        ]

    def run(self, until: int) -> Stop | None:
        """Run all ticks before ``until``; None if nothing failed."""
        place = bisect_left(self._begins, self.tick)
        for tick in self._begins[place : bisect_left(self._begins, until)]:
            if stop := super().run(tick) or self._tick(tick):
                return stop
        return super().run(until)

    def _tick(self, tick: int) -> Stop | None:
        """Run a tick of the fastest task at which others begin."""
        released = [number for number, due in enumerate(self._due) if tick in due]
        for number in released:
            for call in self._delays[number]:
                call()
        if stop := super().run(tick + 1):
            return stop
        for number in released:
            for call in self._latches[number]:
                call()
            part, due = self._executors[1 + number], self._due[number][tick]
            part.tick = due
            if stop := part.run(due + 1):
                return stop
        return None
