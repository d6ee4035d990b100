"""The threads of a diagram with `tasking: multi` in real time: one for each task."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from quadvis.engine.clock import Unpaced
from quadvis.engine.engine import Engine
from quadvis.engine.interpreter import Handover, Interpreter, Stop
from quadvis.engine.taps import MachineCall
from quadvis.native.choice import NATIVE, Choice
from quadvis.native.clock import GO, MachineClock
from quadvis.native.task_executors import TaskExecutors
from quadvis.realtime import dispatch
from quadvis.realtime.clocks import BASE, for_thread
from quadvis.realtime.crew_words import crew_words
from quadvis.realtime.dispatch import AT_ONCE, AT_REST, HEAD, IDLE, ROW
from quadvis.realtime.overload import MEASURED
from quadvis.realtime.pacer import Pacer
from quadvis.realtime.words import address_of, whole_words

SWITCH = 1e-4  # s after which a thread in Python lets another one have the interpreter
PATIENCE = 2.0  # s that steps have to end, when the run ends early


class Crew(TaskExecutors):
    """Runs each task of a program in a thread of its own, the fastest one in the caller's: an executor.

    ``tend`` is called in each new thread before its first step, with the number of its task. ``explain``
    gives the error of a task that has failed.
    """

    def __init__(
        self,
        interpreter: Interpreter,
        choice: Choice,
        pacer: Pacer,
        explain: Callable[[Stop], Exception],
        tend: Callable[[int], None],
    ) -> None:
        self._error: Exception | None = None
        self._explain, self._tend = explain, tend
        self._native = choice.engine == NATIVE
        program = interpreter.program
        self._pause = float(program.tasks[0].period) / 2  # s
        self._crew, self._kept = crew_words(program)
        self._memory = interpreter.memory.raw.cast("q")
        pacer.lead(self._crew, self._failed)
        self._gates = [_Gate(self, number, pacer) for number in range(len(program.tasks))]
        clocks: list[MachineClock] = [pacer, *self._gates[1:]] if self._native else []
        super().__init__(interpreter, choice, self._handover, clocks)
        self._threads: list[threading.Thread] = []

    def _handover(self, number: int) -> Handover:
        own = whole_words(1)
        own[0] = number
        call = partial(dispatch.hand_over, self._crew, self._memory, own)
        if not self._native:
            return Handover(call)
        from quadvis.native.library import library

        places = tuple(map(address_of, (self._crew, self._memory, own)))
        return Handover(call, MachineCall(library().routine(dispatch.HAND_OVER), places, own))

    def start(self, until: int) -> None:
        """Start the threads, for a run of so many ticks whose start is known.

        Signals go to the caller's thread alone.
        """
        sys.setswitchinterval(SWITCH)
        for gate in self._gates:
            gate.start()
        before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        try:
            for number in range(1, len(self._names)):
                thread = threading.Thread(target=self._work, args=(number, until), daemon=True)
                thread.start()
                self._threads.append(thread)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def rest(self, live: Callable[[], object]) -> None:
        """Let all steps end that have begun or are due, and the threads after them.

        Meanwhile call ``live`` at least once in a period of the fastest task.
        """
        self._end(AT_REST)
        for thread in self._threads:
            while thread.is_alive():
                thread.join(self._pause)
                live()
        if self._error is not None:
            raise self._error

    def leave(self) -> None:
        """End the threads after the steps that are running, if these do not last too long."""
        self._end(AT_ONCE)
        for thread in self._threads:
            thread.join(PATIENCE)

    def _end(self, how: int) -> None:
        self._crew[dispatch.QUIT] = max(how, self._crew[dispatch.QUIT])
        for number in range(1, len(self._names)):
            dispatch.post(self._crew, self._crew[HEAD + ROW * number + dispatch.SEMAPHORE])

    def _failed(self) -> Exception:
        """Return the error of the task that has failed."""
        assert self._error is not None
        return self._error

    @property
    def failed(self) -> bool:
        """Return whether a task has failed."""
        return bool(self._crew[dispatch.FAULT])

    def measure(self, number: int, measurement: int) -> None:
        """Time the calls of a task's blocks from now on if the number of the measurement is odd."""
        self._executors[number].time_calls(measurement)

    def busy(self, number: int) -> bool:
        """Return whether a task runs, or is about to: it is released, and waits for no other one."""
        row = HEAD + ROW * number
        return self._crew[row + dispatch.STATE] != IDLE and not self._crew[row + dispatch.WAITS]

    @np.errstate(all="ignore")
    def _work(self, number: int, until: int) -> None:
        """Run the steps of a task: the whole life of its thread."""
        error: Exception | None = None
        try:
            self._tend(number)
            stop = self._natively(number, until + 1) if self._native else self._interpreted(number)
            error = None if stop is None else self._explain(stop)
        except Exception as other:
            error = other
        if error is not None:
            self._error = self._error or error
            self._crew[dispatch.FAULT] = 1

    def _natively(self, number: int, until: int) -> Stop | None:
        try:
            return self._executors[number].run(until)
        except _Quit:
            return None

    def _interpreted(self, number: int) -> Stop | None:
        part, gate = self._executors[number], self._gates[number]
        while (pause := gate.enter()) in (GO, MEASURED):
            if pause == MEASURED:
                gate.answer(pause)
                continue
            part.tick = gate.tick
            stop = part.run(part.tick + 1)
            if stop is not None:
                return stop
        return None


def lead(engine: Engine, choice: Choice, pacer: Pacer, tend: Callable[[int], None]) -> Crew:
    """Let an engine run each task in a thread of its own, as chosen; a pacer dispatches them."""
    made: list[Crew] = []

    def make(interpreter: Interpreter) -> Crew:
        made.append(Crew(interpreter, choice, pacer, engine.explained, tend))
        return made[0]

    engine.run_with(make)
    if choice.engine == NATIVE:
        engine.clock = Unpaced()
    return made[0]


class _Quit(Exception):
    """A thread is to end."""


class _Gate:
    """Where the thread of a task waits until it is released; see `quadvis.native.clock.MachineClock`."""

    def __init__(self, crew: Any, number: int, pacer: Pacer) -> None:
        self._own = whole_words(2)  # its number, and that of the measurement
        self._own[0] = number
        self._pacer = pacer
        self._crew, self._measure = crew._crew, partial(crew.measure, number)
        self._row = HEAD + ROW * number
        self._clock: Any = for_thread(pacer.clock.words)  # of its machine code

    def start(self) -> None:
        """Take the start of the run, which is known now."""
        self._clock[BASE] = self._pacer.clock.words[BASE]

    def enter(self) -> int:
        """Count the step that has ended, and wait; return GO, or another number for the end."""
        plan, _, tasks, noted, _, clock, crew, _ = self._pacer.words
        return dispatch.enter(plan, tasks, noted, clock, crew, self._own)

    @property
    def tick(self) -> int:
        """The tick for which the task was released."""
        return int(self._crew[self._row + dispatch.TICK])

    @property
    def address(self) -> int:
        """The address of its machine code."""
        from quadvis.native.library import library

        return library().routine(dispatch.GATE)

    @property
    def places(self) -> Sequence[int]:
        """The addresses that its machine code takes."""
        plan, _, tasks, noted, *_, crew, _ = self._pacer.words
        return [address_of(each) for each in (plan, tasks, noted, self._clock, crew, self._own)]

    def answer(self, pause: int) -> None:
        """Begin or end a measurement, or end the thread."""
        if pause != MEASURED:
            raise _Quit
        self._measure(self._own[1])
