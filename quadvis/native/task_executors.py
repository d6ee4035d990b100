"""Executors of a program's tasks side by side over one memory: one for each task, the fastest one first."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from quadvis.engine.interpreter import Executor, Handover, Interpreter, Stop
from quadvis.engine.memory import Memory
from quadvis.engine.taps import Observer, Tap
from quadvis.native.choice import Choice, executor
from quadvis.native.clock import MachineClock


class TaskExecutors:
    """Runs the ticks of the fastest task; whoever derives from it sees to the others: an executor.

    ``handover`` gives what a task does for others once its outputs are there, ``clocks`` are those of the
    compiled loops, for each task.
    """

    def __init__(
        self,
        interpreter: Interpreter,
        choice: Choice,
        handover: Callable[[int], Handover | None] = lambda _: None,
        clocks: Sequence[MachineClock | None] = (),
    ) -> None:
        self.memory: Memory = interpreter.memory
        program = interpreter.program
        self._names = [task.name for task in program.tasks]
        self._tasks = {block.path: block.task for block in program.blocks}
        self._parts = [interpreter.part(name, handover(number)) for number, name in enumerate(self._names)]
        self._executors: list[Executor] = [
            executor(part, choice, clock)
            for part, clock in zip(self._parts, clocks or [None] * len(self._parts), strict=True)
        ]

    @property
    def tick(self) -> int:
        """The next tick of the fastest task."""
        return self._executors[0].tick

    @tick.setter
    def tick(self, tick: int) -> None:
        self._executors[0].tick = tick

    def prepare(self) -> None:
        """Do now what would take time at the first ticks."""
        for each in self._executors:
            each.prepare()

    def run(self, until: int) -> Stop | None:
        """Run the ticks of the fastest task before ``until``."""
        return self._executors[0].run(until)

    def attach(self, observer: Tap | Observer) -> None:
        """Have rows taken from now on, or something done at the ticks of a task, by its executor."""
        self._executors[self._number(observer)].attach(observer)

    def detach(self, observer: Tap | Observer) -> None:
        """End what `attach` has begun."""
        self._executors[self._number(observer)].detach(observer)

    def leave_writes(self) -> None:
        """Hand nothing to the world outside any more."""
        for each in self._executors:
            each.leave_writes()

    def time_calls(self, measurement: int) -> None:
        """Time the calls of the fastest task's blocks from now on if the number is odd; else no more."""
        self._executors[0].time_calls(measurement)

    def _number(self, observer: Tap | Observer) -> int:
        name = observer.task if isinstance(observer, Observer) else self._tasks[observer.block]
        return self._names.index(name)
