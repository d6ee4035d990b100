"""The interpreter: the executor that runs a program with blocks in plain Python, at once and anywhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from math import isnan
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.block import NO_FRAME, Block
from quadvis.engine.events import Chatter, EventSolver
from quadvis.engine.layout import TIME
from quadvis.engine.memory import SLOT, Memory
from quadvis.engine.profile import Profile
from quadvis.engine.program import COPY, RESET, Op, Program, TaskProgram
from quadvis.engine.solver import TABLEAUS, Solver, Vector
from quadvis.engine.taps import MachineCall, Observer, Tap
from quadvis.engine.variable_step import NoStep, VariableSolver

Call = Callable[[], None]
NOT_FINITE_OUTPUT = "output"
NOT_FINITE_STATE = "state"
PREPARED = 3  # ticks of each task for which `prepare` makes the calls: they meet most others that are due


class Stop(NamedTuple):
    """Why an executor stopped at a tick: the exception of a block's method, or numbers that are not finite.

    ``blocks`` are the numbers of the blocks that ran, or that alone which failed.
    """

    tick: int
    blocks: tuple[int, ...]
    error: Exception | None = None
    found: str = ""  # NOT_FINITE_OUTPUT, NOT_FINITE_STATE


class Executor(Protocol):
    """Runs a program's ticks over a memory."""

    memory: Memory
    tick: int  # the next to run

    def prepare(self) -> None:
        """Do now what would take time at the first tick."""

    def run(self, until: int) -> Stop | None:
        """Run all ticks before ``until``; None if nothing failed."""

    def attach(self, observer: Tap | Observer) -> None:
        """Have rows taken from now on, or something done at the ticks of a task."""

    def leave_writes(self) -> None:
        """Hand nothing to the world outside any more."""

    def detach(self, observer: Tap | Observer) -> None:
        """End what `attach` has begun."""

    def time_calls(self, measurement: int) -> None:
        """Time the calls of blocks from now on if the number of the measurement is odd; else no more."""


class Handover(NamedTuple):
    """What a task does for others once its outputs are there; ``machine`` does the same as machine code."""

    call: Call
    machine: MachineCall | None = None


@dataclass
class _Moment:
    """The calls of one combination of due tasks at a tick, as flat lists."""

    before: list[Call]  # copies, reads, outputs
    writes: list[Call]
    updates: list[Call]
    finite: NDArray[np.intp]
    zeros: NDArray[np.float64]
    observers: list[Callable[[int], None]]
    taps: list[tuple[Callable[[int, memoryview], None], slice]]
    blocks: tuple[int, ...]


@dataclass
class _Calls:
    """The calls of a program as they are made when first needed; with a ``profile`` they are timed."""

    profile: Profile | None = None
    made: dict[Op, Call] = field(default_factory=dict)
    moments: dict[tuple[bool, ...], _Moment] = field(default_factory=dict)
    derivatives: list[Call] = field(default_factory=list)
    minor: list[Call] = field(default_factory=list)
    events: EventSolver | None = None


class Interpreter:
    """Runs a program with the blocks bound to its memory.

    ``blocks`` are the objects that belong to ``program.blocks``; ``selves`` are the same, bound.
    """

    def __init__(self, program: Program, blocks: Sequence[Block], buffer: Any = None) -> None:
        self.program = program
        frames = [NO_FRAME] * program.frames
        self.memory = Memory(len(program.image) // SLOT, frames, program.image, buffer)
        self.selves = [
            self.memory.bind(block, placed.record, placed.position, placed.frames)
            for block, placed in zip(blocks, program.blocks, strict=True)
        ]
        self._owners: dict[int, int] = {}  # the block of a call, by the call's identity
        self.handover: Handover | None = None
        self._new_profile: Callable[[], Profile] | None = None
        self.profiles: list[Profile] = []  # its own, and those of its parts
        self._bind()

    def _bind(self) -> None:
        """Make ready to run the program from its first tick on."""
        program = self.program
        self.tick = 0
        self._states = np.array(program.states, np.intp)
        self._slopes = np.array(program.slopes, np.intp)
        self._held = slice(0, program.held * SLOT)
        self._solver = Solver(program.solver, float(program.period)) if program.solver in TABLEAUS else None
        self._variable = VariableSolver(program, self.memory) if self._solver is None else None
        self.observers: list[Tap | Observer] = []
        self._rhythms = [(task.every, task.offset) for task in program.tasks]
        self._writes = True
        self._timed: _Calls | None = None
        self._plain = self._made_calls(_Calls())

    def _made_calls(self, calls: _Calls) -> _Calls:
        """Make those between two ticks, and use them from now on."""
        program = self.program
        self._use(calls)
        calls.derivatives.extend(self.call(op) for op in program.derivatives)
        calls.minor.extend(self.call(op) for op in program.minor)
        if self._solver is not None and program.states and program.crossings:
            calls.events = EventSolver(self)
        self._use(calls)
        return calls

    def _use(self, calls: _Calls) -> None:
        """Run these calls; what a tick looks for has no other indirection."""
        self._calls, self._moments = calls.made, calls.moments
        self._derivatives, self._minor = calls.derivatives, calls.minor
        self._events, self.profile = calls.events, calls.profile

    def part(self, name: str, handover: Handover | None = None) -> Interpreter:
        """Return an interpreter for the thread of one task, over the same memory.

        ``handover`` is called at each tick when the outputs are there.
        """
        made = copy(self)
        made.program, made.handover = self.program.part(name), handover
        made._bind()
        return made

    def apart(self, program: Program) -> Interpreter:
        """Return an interpreter for another program over the same memory, which times no calls."""
        made = copy(self)
        made.program, made.handover, made._new_profile = program, None, None
        made._owners = {}
        made._bind()
        return made

    def measure(self, profile: Callable[[], Profile]) -> None:
        """Make it possible to time the calls of blocks; ``profile`` gives one to this and to each part."""
        self._new_profile = profile

    @property
    def can_time(self) -> bool:
        """True if calls can be timed."""
        return self._new_profile is not None

    def time(self, on: bool) -> None:
        """Run timed calls from now on, or plain ones, within the measurement that there is."""
        if on and self._timed is None:
            assert self._new_profile is not None
            self.profiles.append(self._new_profile())
            self._timed = self._made_calls(_Calls(self.profiles[-1]))
        self._use(self._timed if on and self._timed is not None else self._plain)

    def time_calls(self, measurement: int) -> None:
        """Time the calls of blocks from now on if the number of the measurement is odd; else no more."""
        self.time(measurement % 2 == 1)
        if self._timed is not None and self._timed.profile is not None:
            self._timed.profile.begin(measurement)

    def call(self, op: Op) -> Call:
        """Return the function that runs an operation: one call over the memory."""
        if op not in self._calls:
            self._calls[op] = made = self._made(op)
            self._owners[id(made)] = op.block
        return self._calls[op]

    def _made(self, op: Op) -> Call:
        if op.method == COPY:
            return self.memory.copy(op.sources[0], op.targets[0])
        if op.method == RESET:
            members = [self.selves[number] for number in self.program.members(op.block)]
            return self.memory.reset(op.sources[0], op.targets, self.program.image, members)
        made = self.memory.call(getattr(self.selves[op.block], op.method), op.sources, op.targets)
        if self.profile is not None:
            made = self.profile.timed(made, op.block, op.method)
        gate = self.program.gate(op.block)
        if gate is None:
            return made
        return self.memory.gated(made, gate, op.targets if op.method == "deriv" else ())

    def detach(self, observer: Tap | Observer) -> None:
        """End what `attach` has begun."""
        self.observers.remove(observer)
        self._forget_moments()

    def attach(self, observer: Tap | Observer) -> None:
        """Have rows taken from now on, or something done at the ticks of a task."""
        self.observers.append(observer)
        rhythm = self.rhythm(observer)
        if rhythm not in self._rhythms:
            self._rhythms.append(rhythm)
        self._forget_moments()

    def leave_writes(self) -> None:
        """Hand nothing to the world outside any more."""
        self._writes = False
        self._forget_moments()

    def _forget_moments(self) -> None:
        for calls in filter(None, (self._plain, self._timed)):
            calls.moments.clear()

    def rhythm(self, observer: Tap | Observer) -> tuple[int, int]:
        """Return after how many ticks an observer is due again, and its first tick."""
        name = observer.task if isinstance(observer, Observer) else self.program[observer.block].task
        task = self.program.task(name)
        return task.every * observer.every, task.offset

    def prepare(self) -> None:
        """Make the calls of the first ticks of each task, timed ones, too, if they may be wanted."""
        tick, before = self.tick, self.profile is not None
        for timed in (False, True) if self.can_time else (False,):
            self.time(timed)
            for number in range(PREPARED):
                for every, offset in self._rhythms:
                    self.tick = offset + number * every
                    self._moment()
        self.time(before)
        self.tick = tick

    def run(self, until: int) -> Stop | None:
        """Run all ticks before ``until``; None if nothing failed."""
        floats, raw = self.memory.floats, self.memory.raw
        clock = raw.cast("d")  # one element costs a third of a numpy array's
        period, denominator = self.program.period.as_integer_ratio()
        continuous = self._states.size > 0
        while self.tick < until:
            tick = self.tick
            moment = self._moment()
            # An exact product, so that time has no drift; the quotient of integers is rounded once.
            clock[self.program.time.position] = tick * period / denominator
            call = None
            try:
                for call in moment.before:
                    call()
                if isnan(floats.take(moment.finite).dot(moment.zeros)):
                    return Stop(tick, moment.blocks, found=NOT_FINITE_OUTPUT)
                for call in moment.writes:
                    call()
            except Exception as error:
                return self._stop(call, error)
            for observe in moment.observers:
                observe(tick)
            for take, row in moment.taps:
                take(tick, raw[row])
            try:
                for call in moment.updates:
                    call()
            except Exception as error:
                return self._stop(call, error)
            if continuous:
                stop = self.integrate()
                if stop is not None:
                    return stop
            self.tick = tick + 1
        return None

    def _moment(self) -> _Moment:
        """Return the calls of the next tick."""
        tick = self.tick
        due = tuple([(tick - offset) % every == 0 and tick >= offset for every, offset in self._rhythms])
        return self._moments.get(due) or self._prepare(due)

    def _stop(self, call: Call | None, error: Exception) -> Stop:
        return Stop(self.tick, (self._owners[id(call)],), error)

    def _prepare(self, due: tuple[bool, ...]) -> _Moment:
        rhythms = {rhythm for rhythm, flag in zip(self._rhythms, due, strict=True) if flag}
        tasks = [task for task in self.program.tasks if (task.every, task.offset) in rhythms]
        finite = np.array([position for task in tasks for position in task.finite], np.intp)
        attached = [observer for observer in self.observers if self.rhythm(observer) in rhythms]
        made = _Moment(
            self._due_calls("before", tasks) + ([self.handover.call] if self.handover else []),
            self._due_calls("write", tasks) if self._writes else [],
            self._due_calls("update", tasks),
            finite,
            np.zeros(finite.size),
            [observer.call for observer in attached if isinstance(observer, Observer)],
            [(tap.take, self.program[tap.block].row) for tap in attached if not isinstance(tap, Observer)],
            self.due_blocks(self.tick),
        )
        self._moments[due] = made
        return made

    def _due_calls(self, phase: str, tasks: Sequence[TaskProgram]) -> list[Call]:
        return [self.call(op) for task, op in self.program.phase(phase) if task in tasks]

    def due_blocks(self, tick: int) -> tuple[int, ...]:
        """Return the numbers of the blocks that run at a tick."""
        names = {
            task.name
            for task in self.program.tasks
            if tick >= task.offset and (tick - task.offset) % task.every == 0
        }
        return tuple(number for number, block in enumerate(self.program.blocks) if block.task in names)

    def integrate(self) -> Stop | None:
        """Carry the continuous states over one tick, as the solver does."""
        raw, floats = self.memory.raw, self.memory.floats
        time = float(floats[TIME.position])
        # Minor steps write over time and signals, but delays and readers want those of the tick.
        held = bytes(raw[self._held])
        call = None
        try:
            if self._variable is not None:
                state = self._variable.advance(self.rates, self.tick)
            elif self._events is not None:
                state = self._events.advance(time, floats[self._states])
            else:
                assert self._solver is not None
                for call in self._derivatives:
                    call()
                state = self._solver.advance(self.rates, time, floats[self._states], floats[self._slopes])
        except MinorError as failure:
            return self._stop(failure.call, failure.error)
        except Chatter as error:
            return Stop(self.tick, (error.block,), error)
        except NoStep as error:
            return Stop(self.tick, (), error)
        except Exception as error:
            return self._stop(call, error)
        raw[self._held] = held
        floats[self._states] = state
        return None if np.isfinite(state).all() else Stop(self.tick, (), found=NOT_FINITE_STATE)

    def restart(self) -> None:
        """Let a solver with a memory of its own begin anew at the next tick."""
        if self._variable is not None:
            self._variable.restart()

    def rates(self, time: float, state: Vector) -> Vector:
        """Return the derivative at a minor step, written over the memory; MinorError if a block fails."""
        floats = self.memory.floats
        floats[TIME.position] = time
        floats[self._states] = state
        self.run_calls(self._minor)
        self.run_calls(self._derivatives)
        return floats[self._slopes]

    def run_calls(self, calls: Sequence[Call]) -> None:
        """Run calls of blocks in their order; MinorError if one fails."""
        call: Call = _nothing
        try:
            for call in calls:
                call()
        except Exception as error:
            raise MinorError(call, error) from error

    def asked(self, op: Op) -> Any:
        """Return what a method of a block gives for the present values of its sources; MinorError."""
        try:
            return getattr(self.selves[op.block], op.method)(*(self.memory.read(slot) for slot in op.sources))
        except Exception as error:
            raise MinorError(self.call(op), error) from error

    @np.errstate(all="ignore")  # as in a run
    def crossing_size(self, op: Op) -> int:
        """Return how many values a ``crossing`` gives; MinorError if it fails now."""
        return int(np.size(self.asked(op)))


class MinorError(Exception):
    """A block failed at a minor step."""

    def __init__(self, call: Call, error: Exception) -> None:
        super().__init__(str(error))
        self.call, self.error = call, error


def _nothing() -> None:
    """Do nothing."""
