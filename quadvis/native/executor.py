"""The executor that runs a program in the compiled loop; what is Python's only goes to the interpreter."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from fractions import Fraction

from quadvis.engine.interpreter import NOT_FINITE_OUTPUT, Interpreter, Stop
from quadvis.engine.memory import Memory
from quadvis.engine.program import Op
from quadvis.engine.taps import Observer, Tap
from quadvis.native import loop
from quadvis.native.clock import MachineClock
from quadvis.native.tables import Function, PythonCall, Tables

EXACT = 1 << 53  # whole numbers below are exact as floats
INSTRUCTIONS = 1 << 25  # after so many, some tenths of a second, Python has its turn: Ctrl-C


def last_exact(period: Fraction) -> int:
    """Return the last tick whose time the compiled loop works out exactly."""
    numerator, denominator = period.as_integer_ratio()
    return (EXACT - 1) // numerator if denominator < EXACT else -1


class NativeExecutor:
    """Runs a program's ticks over an interpreter's memory, at the address of the compiled loop.

    A compiled call that fails is repeated by the interpreter: its result, or its exception, is what counts.
    Rows reach their taps when a ring is full, and at the latest at the end of ``run``. With a clock, the loop
    runs each tick when the clock lets it go.
    """

    def __init__(
        self,
        interpreter: Interpreter,
        address: int,
        function: Callable[[Op], Function | None],
        clock: MachineClock | None = None,
    ) -> None:
        self.interpreter, self._clock = interpreter, clock
        self.memory: Memory = interpreter.memory
        self._function = function
        self._run = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(address)
        self._tables: dict[bool, Tables] = {}  # with timed calls, and with plain ones
        self._writes = True
        self._reached = -1  # the tick for which the tables are ready, if nothing else has moved it
        self._last = last_exact(interpreter.program.period)

    @property
    def tick(self) -> int:
        """The next tick to run."""
        return self.interpreter.tick

    @tick.setter
    def tick(self, tick: int) -> None:
        self.interpreter.tick = tick

    def attach(self, observer: Tap | Observer) -> None:
        """Have rows taken from now on, or something done at the ticks of a task."""
        self.interpreter.attach(observer)
        self._tables.clear()

    def leave_writes(self) -> None:
        """Hand nothing to the world outside any more."""
        self.interpreter.leave_writes()
        self._writes = False
        for tables in self._tables.values():
            tables.leave_writes()

    def detach(self, observer: Tap | Observer) -> None:
        """End what `attach` has begun."""
        self.interpreter.detach(observer)
        self._tables.clear()

    def time_calls(self, measurement: int) -> None:
        """Time the calls of blocks from now on if the number of the measurement is odd; else no more."""
        self.interpreter.time_calls(measurement)
        self._reached = -1

    def prepare(self) -> None:
        """Make the tables, those with timed calls, too, if they may be wanted."""
        before = self.interpreter.profile is not None
        for timed in (False, True) if self.interpreter.can_time else (False,):
            self.interpreter.time(timed)
            self._made()
        self.interpreter.time(before)

    def _made(self) -> Tables:
        """Return the tables for the present calls of the interpreter."""
        timed = self.interpreter.profile is not None
        if timed not in self._tables:
            self._tables[timed] = made = Tables(self.interpreter, self._function, self._clock)
            self._reached = -1
            if not self._writes:
                made.leave_writes()
        return self._tables[timed]

    def run(self, until: int) -> Stop | None:
        """Run all ticks before ``until``; None if nothing failed."""
        if until > self._last:
            assert self._clock is None, "whoever gives a clock asks `last_exact` first"
            return self.interpreter.run(until)
        while self.tick < until:
            tables = self._made()
            turn = until if self._clock else max(1, INSTRUCTIONS // max(1, len(tables.code)))
            stop = self._turn(tables, min(until, self.tick + turn))
            if stop is not None:
                return stop
        return None

    def _turn(self, tables: Tables, until: int) -> Stop | None:
        control = tables.control
        if self.tick != self._reached:
            tables.waits(self.tick)
        self._reached = -1
        control[loop.TICK], control[loop.UNTIL], control[loop.SEGMENT] = self.tick, until, -1
        try:
            while True:
                self._run(tables.address)
                self.tick, result = control[loop.TICK], control[loop.RESULT]
                if result == loop.DONE:
                    self._reached = self.tick
                    return None
                if result == loop.FULL:
                    _hand_on(tables)
                    continue
                if result == loop.PAUSED:
                    assert self._clock is not None
                    self._clock.answer(control[loop.PAUSE])
                    if self._made() is not tables:  # calls are timed from now on, or no more
                        return None
                    continue
                stop = self._answer(tables, result, control[loop.PLACE])
                if stop is not None:
                    return stop
                control[loop.PLACE] += 1
        finally:
            _hand_on(tables)  # also at Ctrl-C: a log has all rows up to there

    def _answer(self, tables: Tables, result: int, place: int) -> Stop | None:
        """Do what the loop asks for at an instruction."""
        if result == loop.NOT_FINITE:
            return Stop(self.tick, self.interpreter.due_blocks(self.tick), found=NOT_FINITE_OUTPUT)
        if result == loop.ASKED:
            return self._do(tables.python[tables.code[place, 1]])
        redo = tables.redo[place]
        if redo.record is not None:  # an update begins again with the record that it had
            self.memory.raw[redo.record] = tables.saved(redo.record.stop - redo.record.start)
        return self._do(redo.python)

    def _do(self, python: PythonCall) -> Stop | None:
        if python.observer is not None:
            python.observer(self.tick)
            return None
        if python.call is None:
            return self.interpreter.integrate()
        try:
            python.call()
        except Exception as error:
            return Stop(self.tick, (python.block,), error)
        return None


def _hand_on(tables: Tables) -> None:
    """Give the rows in the rings to their taps."""
    for tap, ticks, rows in tables.rows():
        tap.take_all(ticks, rows)
