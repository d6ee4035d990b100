"""A clock that stands still until it is told, and engines that a pacer runs by it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from quadvis.api import Diagram
from quadvis.diagram.sections.overload import OverloadLimits
from quadvis.engine.engine import Engine
from quadvis.native.choice import choose, use
from quadvis.realtime.control import SharedMemory
from quadvis.realtime.overload import OverloadWatch
from quadvis.realtime.pacer import Pacer
from quadvis.realtime.schedule import Schedule
from quadvis.realtime.streams import RowStream
from quadvis.realtime.times import TaskTimes

WARN = OverloadLimits(action="warn")


class FakeClock:
    """The present instant (ns); a sleep ends at its instant, or later by what ``late`` says for its turn."""

    def __init__(self, late: dict[int, int] | None = None) -> None:
        self.instant, self.late = -1000, late or {}
        self.sleeps = 0

    def now(self) -> int:
        return self.instant

    def sleep(self, until: int) -> None:
        self.instant = max(self.instant, until) + self.late.get(self.sleeps, 0)
        self.sleeps += 1


class Paced:
    """An engine that a pacer runs by a fake clock, without a process of its own."""

    def __init__(
        self,
        diagram: Diagram,
        clock: FakeClock,
        limits: OverloadLimits = WARN,
        streams: Sequence[RowStream] = (),
        engine: str = "python",
    ) -> None:
        graph = diagram.graph
        rings = [stream.ring for stream in streams]
        words = np.zeros(SharedMemory.size(len(graph.tasks), rings), np.int64)
        self.shared = SharedMemory(words, len(graph.tasks), rings)
        self.schedule = Schedule.of(graph)
        self._tasks = graph.tasks
        watch = OverloadWatch([task.name for task in graph.tasks], limits)
        self.pacer = Pacer(self.schedule, watch, self.shared, clock.now, clock.sleep)
        self.engine = Engine(graph, diagram.seed, self.pacer)
        use(self.engine, choose(self.engine, 10**9, engine))
        for stream, ring in zip(streams, self.shared.rings, strict=True):
            self.engine.observe(stream.task, stream.put_into(ring, self.engine), stream.every)

    def run(self, ticks: int) -> dict[str, TaskTimes]:
        with self.engine:
            self.engine.run(ticks)
            self.pacer.finish()
        return self.times

    @property
    def times(self) -> dict[str, TaskTimes]:
        tasks: Any = zip(self._tasks, self.shared.tasks, strict=True)
        return {task.name: TaskTimes.read(task.name, float(task.period), words) for task, words in tasks}
