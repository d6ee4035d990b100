"""A clock that stands still until it is told, and engines that a pacer runs by it."""

from __future__ import annotations

import ctypes
import errno
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from quadvis.api import Diagram
from quadvis.diagram.sections.overload import OverloadLimits
from quadvis.engine.engine import Engine
from quadvis.graph.graph import MULTI
from quadvis.native.choice import NATIVE, choose, use
from quadvis.realtime import clocks
from quadvis.realtime.clocks import Timekeeper, machine_words
from quadvis.realtime.control import SharedMemory
from quadvis.realtime.crew import Crew, lead
from quadvis.realtime.pacer import Pacer
from quadvis.realtime.profiles import ProfileBox, ProfileRoom
from quadvis.realtime.schedule import NANOSECONDS, Schedule
from quadvis.realtime.streams import RowStream, room_for
from quadvis.realtime.times import TaskTimes

ROOM = 64  # words for a group of parameters
WARN = OverloadLimits(action="warn")


class Timespec(ctypes.Structure):
    """An instant as C has it."""

    _fields_ = (("seconds", ctypes.c_int64), ("rest", ctypes.c_int64))

    @property
    def value(self) -> int:
        return int(self.seconds * NANOSECONDS + self.rest)

    def put(self, value: int) -> None:
        self.seconds, self.rest = divmod(value, NANOSECONDS)


C_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int32, *[ctypes.c_int64] * 4)
BEFORE = NANOSECONDS  # the instant 0 of a fake clock in the time of its C functions, which is never negative


class FakeClock:
    """The present instant (ns); a sleep ends at its instant, or so much later as ``late`` says.

    If it ends earlier, a signal has come.

    ``words`` are the same clock for machine code, by C functions that call Python.
    """

    def __init__(self, late: dict[int, int] | None = None) -> None:
        self.instant, self.late = -1000, late or {}
        self.sleeps = 0
        self._functions = C_FUNCTION(self._get), C_FUNCTION(self._wait)
        self.words = machine_words(*self._functions)
        self.words[clocks.START] = self.words[clocks.BASE] = BEFORE

    def now(self) -> int:
        return self.instant - self.shift

    @property
    def shift(self) -> int:
        return int(self.words[clocks.START] - self.words[clocks.BASE])

    def follow(self, shift: int) -> None:
        self.words[clocks.START] = self.words[clocks.BASE] + shift

    def unshifted(self) -> int:
        return self.instant

    def sleep(self, until: int) -> None:
        until += self.shift
        self.instant = max(self.instant, until) + self.late.get(self.sleeps, 0)
        self.sleeps += 1

    def _get(self, _: int, place: int, __: int, ___: int) -> int:
        Timespec.from_address(place).put(self.instant + BEFORE)
        return 0

    def _wait(self, _: int, __: int, place: int, ___: int) -> int:
        until = Timespec.from_address(place).value - BEFORE
        self.sleep(until - self.shift)
        return 0 if self.instant >= until else errno.EINTR


class CrewClock(FakeClock):
    """A fake clock for several threads: it goes on while all of them wait, or are busy."""

    def __init__(self) -> None:
        super().__init__()
        self.idle: Callable[[], set[int]] = set  # the tasks that rest
        self.tasks = 1
        self._change = threading.Condition()
        self._until: dict[int, int] = {}  # when the tasks that are busy will be done

    def work(self, task: int, time: int) -> None:
        """Let the step of a task that runs in this thread take so long."""
        with self._change:
            self._until[task] = self.instant + time
            while task in self._until:
                assert self._change.wait(30)

    def sleep(self, until: int) -> None:
        until += self.shift
        with self._change:
            self.sleeps += 1
            while True:
                self._settle()
                first = min(self._until, key=self._until.__getitem__, default=0)
                if not first or self._until[first] > until:
                    break
                self.instant = max(self.instant, self._until.pop(first))
                self._change.notify_all()
            self.instant = max(self.instant, until)

    def end(self) -> None:
        """Let all steps end at once."""
        with self._change:
            self._until.clear()
            self._change.notify_all()

    def _settle(self) -> None:
        """Wait until each task rests or is busy."""
        end = time.monotonic() + 30
        while len(self.idle() | self._until.keys()) < self.tasks - 1:
            assert time.monotonic() < end
            self._change.wait(0.0005)


class Paced:
    """An engine that a pacer runs by a fake clock, without a process of its own."""

    def __init__(
        self,
        diagram: Diagram,
        clock: Timekeeper,
        limits: OverloadLimits = WARN,
        streams: Sequence[RowStream] = (),
        engine: str = "python",
        computer: str = "",
    ) -> None:
        graph, self._clock = diagram.graph, clock
        rings = [stream.ring for stream in streams]
        rooms = [room_for(task.period) for task in graph.tasks]
        words = np.zeros(SharedMemory.size(rooms, rings, ROOM), np.int64)
        self.shared = SharedMemory(words, rooms, rings, ROOM)
        self.schedule = Schedule.of(graph)
        self._tasks = graph.tasks
        names = [task.name for task in graph.tasks]
        each = [limits.of(name) for name in names]
        self.pacer = Pacer(
            self.schedule, names, each, self.shared, clock, lambda: self.engine.hold_safe(), computer,
            lambda number: self.engine.time_calls(number),
        )  # fmt: skip
        self.engine = Engine(graph, diagram.seed, self.pacer)
        self.pacer.write_into(self.engine.memory)
        profiles = ProfileRoom.of(graph, whole=False)
        self.profiles = ProfileBox(np.zeros(profiles.words, np.int64), profiles)
        self.engine.measure(self.profiles.new)
        native, choice = engine == NATIVE, choose(self.engine, 10**9, engine)
        self.crew = None
        if graph.tasking == MULTI:
            assert isinstance(clock, CrewClock)
            self.crew = crew = lead(self.engine, choice, self.pacer, lambda _: None)
            tasks = range(1, len(names))
            clock.tasks, clock.idle = (
                len(names),
                lambda: {task for task in tasks if crew.failed or not crew.busy(task)},
            )
        else:
            use(self.engine, choice, self.pacer if native else None)
        for stream, ring in zip(streams, self.shared.rings, strict=True):
            stream.put_into(ring, self.engine, native)

    def run(self, ticks: int) -> dict[str, TaskTimes]:
        with self.engine:
            if self.crew is None:
                self.engine.run(ticks)
            else:
                self._run_all(self.crew, ticks)
            self.pacer.finish()
        return self.times

    def _run_all(self, crew: Crew, ticks: int) -> None:
        """Run with threads; the clock goes on until all of them rest."""
        assert isinstance(self._clock, CrewClock)
        crew.start(ticks)
        try:
            self.engine.run(ticks)
            self._clock.sleep(self.schedule.deadline(10 * ticks))
            self.pacer.conclude(crew.rest, ticks)
        finally:
            self._clock.end()
            crew.leave()

    @property
    def times(self) -> dict[str, TaskTimes]:
        tasks: Any = zip(self._tasks, self.shared.tasks, strict=True)
        return {task.name: TaskTimes.read(task.name, float(task.period), words) for task, words in tasks}
