"""A program as the numbers that the compiled loop reads: rhythms, segments, instructions, places.

The tables belong to one memory, since they hold addresses in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadvis.block.interface import CROSSING
from quadvis.engine.interpreter import Call, Interpreter, MinorError
from quadvis.engine.memory import SLOT, Slot
from quadvis.engine.program import COPY, RESET, Op, Program
from quadvis.engine.solver import TABLEAUS
from quadvis.engine.taps import Observer, Tap
from quadvis.native import loop
from quadvis.native.clock import MachineClock
from quadvis.native.event_tables import EventTables, Span
from quadvis.native.stages import stage_numbers
from quadvis.native.timing import PLACES, TimedCalls

Rhythm = tuple[int, int]  # ticks from one time to the next, and the first tick
Whole = NDArray[np.int64]
ALWAYS: Rhythm = (1, 0)
ROOM = 1 << 16  # bytes of the rows of one tap
FEW = 16  # slots, which are copied one by one


def _gives(self: Any) -> Any:
    return self.field


def _keeps(self: Any, value: Any) -> None:
    self.field = value


def _keeps_too(self: Any, value: Any) -> None:
    """With a text, the code has its None in another place."""
    self.field = value


# The code of a method that copies a field of its block to its only output, or its first input to a field.
GIVES = _gives.__code__.co_code
KEEPS = frozenset(function.__code__.co_code for function in (_keeps, _keeps_too))


@dataclass(frozen=True)
class Function:
    """A compiled method: its address, and whether it can fail."""

    address: int
    fallible: bool


@dataclass(frozen=True)
class Ring:
    """The rows of a tap on their way to it: a tick and the slots of a row, row by row."""

    tap: Tap
    start: int
    room: int
    size: int


@dataclass(frozen=True)
class PythonCall:
    """Something that the interpreter does: a call of a block, an observer, or the solver's step."""

    call: Call | None  # None for the solver's step
    block: int  # the block's number; -1 for an observer and for the solver
    observer: Callable[[int], None] | None = None


@dataclass(frozen=True)
class Redo:
    """How to repeat an instruction in Python: the call, and the record that it may have changed half way."""

    python: PythonCall
    record: slice | None  # bytes of memory, of which the copy was made before


@dataclass
class _Gate:
    """A gate, and how many instructions stand behind it; ``idle`` are zero while it is shut."""

    slot: Slot
    idle: Sequence[Slot] = ()
    count: int = 0

    @property
    def operands(self) -> list[int]:
        """Its numbers, as the loop takes them."""
        zeros = [slot.position + index for slot in self.idle for index in range(slot.size)]
        return [self.slot.position, self.count, len(zeros), *zeros]


class _Events(NamedTuple):
    """The step with events: what it works on, its instruction, and the instructions that it calls."""

    tables: EventTables
    step: int
    crossings: Span
    events: Sequence[Span]
    renewed: Span


def _gate(program: Program, op: Op) -> Slot | None:
    """Return what a call depends on: the condition of its block, or of a reset."""
    return op.sources[0] if op.method == RESET else program.gate(op.block)


class Tables:
    """The tables of a program; ``function`` gives the compiled method of a call, or None.

    ``clock`` is what the loop waits for before each tick.
    """

    def __init__(
        self,
        interpreter: Interpreter,
        function: Callable[[Op], Function | None],
        clock: MachineClock | None = None,
    ) -> None:
        self._interpreter, self._function, self._clock = interpreter, function, clock
        self._control: Whole = np.zeros(loop.CONTROLS, np.int64)
        program, memory = interpreter.program, interpreter.memory
        self._base = memory.floats.ctypes.data
        self._saved: Whole = np.zeros(
            max((block.record.size for block in program.blocks), default=0), np.int64
        )
        self._timed = TimedCalls(interpreter.profile) if interpreter.profile is not None else None
        self._calls_timed: list[tuple[int, Any]] = []  # first place, words of its timing
        self._rhythms: dict[Rhythm, int] = {}
        self._segments: list[list[int]] = []
        self._code: list[tuple[int, int]] = []
        self._operands: list[int] = []
        self._pairs: dict[int, list[tuple[int, int]]] = {}  # what an instruction copies
        self._places: list[int] = []  # addresses for calls
        self._calls: list[tuple[int, int]] = []  # instruction, and the index of its first place
        self.python: list[PythonCall] = []
        self.redo: dict[int, Redo] = {}  # by instruction
        self.rings: list[Ring] = []
        self._fresh = True  # the next instruction begins a segment
        self._gate: Slot | None = None  # what the instructions that are being laid out depend on
        self._gates: dict[int, _Gate] = {}  # by the instruction
        self._open: _Gate | None = None  # the gate that the next instruction may stand behind
        # The instructions of the calls between two ticks.
        self._minor: Span = (0, 0)
        self._derivatives: Span = (0, 0)
        self._events: _Events | None = None
        self._lay_out()
        self._finish()

    def saved(self, size: int) -> bytes:
        """Return the copy of the record that the last fallible update began with."""
        return self._saved[: size // SLOT].tobytes()

    def leave_writes(self) -> None:
        """Leave out the instructions with which blocks write."""
        self._control[loop.LEFT : loop.LEFT_END + 1] = self._writes

    def waits(self, tick: int) -> None:
        """Set how many ticks each rhythm waits, for a loop that begins at a tick."""
        for index, (every, first) in enumerate(self._rhythms):
            self.rhythms[2 * index : 2 * index + 2] = (
                every,
                first - tick if tick < first else -(tick - first) % every,
            )

    def _lay_out(self) -> None:
        program = self._interpreter.program
        self._ops("before")
        handover = self._interpreter.handover
        if handover is not None and handover.machine is not None:
            self._machine(ALWAYS, handover.machine.address, handover.machine.places)
        elif handover is not None:
            self._ask(ALWAYS, PythonCall(handover.call, -1))
        for task in program.tasks:
            for first, count in _runs(task.finite):
                self._add((task.every, task.offset), loop.CHECK, first, count)
        self._fresh = True
        first = len(self._segments)
        self._ops("write")
        self._fresh = True
        self._writes = first, len(self._segments)
        for observer in sorted(self._interpreter.observers, key=lambda each: not isinstance(each, Observer)):
            self._observer(observer)
        self._ops("update")
        if program.states:
            self._solver()

    def _ops(self, phase: str) -> None:
        """Lay out the calls of a phase, each behind the gate of its block."""
        program = self._interpreter.program
        for task, op in program.phase(phase):
            self._gate = _gate(program, op)
            self._op((task.every, task.offset), op)
        self._gate = None

    def _add(self, rhythm: Rhythm, kind: int, *operands: int) -> int:
        """Add an instruction with its numbers at a rhythm; return its place."""
        self._operands += operands
        return self._instruct(rhythm, kind, len(self._operands) - len(operands))

    def _instruct(self, rhythm: Rhythm, kind: int, operand: int) -> int:
        number = self._rhythms.setdefault(rhythm, len(self._rhythms))
        if self._fresh or self._segments[-1][0] != number:
            self._fresh = False
            self._open = None
            self._segments.append([number, len(self._code), len(self._code)])
        self._behind(self._gate)
        self._code.append((kind, operand))
        self._segments[-1][2] = len(self._code)
        return len(self._code) - 1

    def _behind(self, gate: Slot | None, idle: Sequence[Slot] = ()) -> None:
        """Let the next instruction stand behind a gate, the one before it if that is the same."""
        if gate is None:
            self._open = None
        elif self._open is None or self._open.slot != gate or idle:
            self._open = self._gates[len(self._code)] = _Gate(gate, idle)
            self._code.append((loop.GATE, 0))
        if self._open is not None:
            self._open.count += 1

    def _copy(self, rhythm: Rhythm, source: int, target: int, size: int) -> None:
        """Add copies of slots: many at once, a few to those just before if there are any."""
        if size > FEW:
            self._add(rhythm, loop.MOVE, source, target, size)
            return
        before = len(self._code) - 1
        follows = not self._fresh and self._segments[-1][0] == self._rhythms.get(rhythm)
        follows = follows and self._gate == (self._open.slot if self._open is not None else None)
        if not follows or before not in self._pairs:
            before = self._instruct(rhythm, loop.COPY, 0)
        self._pairs.setdefault(before, []).extend((source + index, target + index) for index in range(size))

    def _op(self, rhythm: Rhythm, op: Op) -> None:
        if op.method == COPY and op.sources[0].scalar != "frame":
            self._copy(rhythm, op.sources[0].position, op.targets[0].position, op.sources[0].size)
            return
        python = PythonCall(self._interpreter.call(op), op.block)
        function = None if op.method in (COPY, RESET) else self._function(op)
        if function is None:
            self._ask(rhythm, python)
            return
        block = self._interpreter.program.blocks[op.block]
        copy = self._as_copy(op) if self._timed is None else None
        if copy is not None:
            self._copy(rhythm, copy[0].position, copy[1].position, copy[0].size)
            return
        record = None
        if function.fallible and op.method == "update":
            record = slice(block.position * SLOT, (block.position + block.record.size) * SLOT)
            saved = (self._saved.ctypes.data - self._base) // SLOT
            self._copy(rhythm, block.position, saved, block.record.size)
        number = self._instruct(rhythm, loop.PYTHON, 0)
        self._code[number] = self._call(function, op, number)
        if function.fallible:
            self.redo[number] = Redo(python, record)

    def _as_copy(self, op: Op) -> tuple[Slot, Slot] | None:
        """Return the slots from which and to which a method copies, if it does nothing else."""
        code = getattr(self._interpreter.selves[op.block], op.method).__code__
        block = self._interpreter.program.blocks[op.block]
        gives, keeps = code.co_code == GIVES, code.co_code in KEEPS
        if not (gives or keeps) or code.co_names[0] not in {field.name for field in block.record.fields}:
            return None
        field = block.field(code.co_names[0])
        if len(op.targets) != (1 if gives else 0):
            return None
        source, target = (field, op.targets[0]) if gives else (op.sources[0], field)
        return (source, target) if source[:2] == target[:2] else None

    def _call(self, function: Function, op: Op, number: int, targets: Sequence[int] = ()) -> tuple[int, int]:
        """Return the instruction of a call, for its place; `_finish` makes an address of its operand.

        ``targets`` are addresses outside of memory to which it writes.
        """
        block = self._interpreter.program.blocks[op.block]
        first = len(self._places)
        positions = [block.position, *(slot.position for slot in (*op.sources, *op.targets))]
        self._places += [*(self._base + position * SLOT for position in positions), *targets]
        address = function.address
        if self._timed is not None and op.method != CROSSING:  # the interpreter does not time it, either
            call, places = self._timed.call(op.block, op.method, address)
            self._calls_timed.append((first, call))
            address, first = self._timed.address, len(self._places)
            self._places += places
        self._calls.append((number, first))
        return address, first

    def _ask(self, rhythm: Rhythm, python: PythonCall) -> int:
        self.python.append(python)
        return self._instruct(rhythm, loop.PYTHON, len(self.python) - 1)

    def _observer(self, observer: Tap | Observer) -> None:
        rhythm = self._interpreter.rhythm(observer)
        if isinstance(observer, Observer):
            if observer.machine is None:
                self._ask(rhythm, PythonCall(None, -1, observer.call))
                return
            address, places, _ = observer.machine
            self._machine(rhythm, address, (self._control.ctypes.data + SLOT * loop.TICK, *places))
            return
        row = self._interpreter.program[observer.block].row
        size = (row.stop - row.start) // SLOT
        room = max(1, ROOM // (SLOT * (size + 1)))
        start = self.rings[-1].start + self.rings[-1].room * (self.rings[-1].size + 1) if self.rings else 0
        self._add(rhythm, loop.ROW, len(self.rings), row.start // SLOT, size)
        self.rings.append(Ring(observer, start, room, size))

    def _machine(self, rhythm: Rhythm, address: int, places: Sequence[int]) -> None:
        """Add a call of machine code that is no block's."""
        self._calls.append((len(self._code), len(self._places)))
        self._places += places
        self._instruct(rhythm, address, 0)

    def _solver(self) -> None:
        """Add the solver's step: compiled, if all that it calls is."""
        program = self._interpreter.program
        python = PythonCall(None, -1)
        located = program.solver in TABLEAUS and bool(program.crossings)
        ops = (*program.minor, *program.derivatives)
        if located:
            ops = (*ops, *program.crossings, *program.events, *program.renewed)
        if program.solver not in TABLEAUS or any(self._function(op) is None for op in ops):
            self._ask(ALWAYS, python)
            return
        tables = None
        if located:
            try:
                tables = EventTables(self._interpreter)
            except MinorError:  # it will be asked again at the first step
                self._ask(ALWAYS, python)
                return
        step = self._instruct(ALWAYS, loop.INTEGRATE if tables is None else tables.step, 0)
        self.redo[step] = Redo(python, None)
        self._minor, self._derivatives = self._calls_of(program.minor), self._calls_of(program.derivatives)
        if tables is not None:
            targets = [tables.targets(number) for number in range(len(program.crossings))]
            self._events = _Events(
                tables, step, self._calls_of(program.crossings, targets),
                [self._calls_of([op]) for op in program.events], self._calls_of(program.renewed),
            )  # fmt: skip

    def _calls_of(self, ops: Sequence[Op], targets: Sequence[Sequence[int]] = ()) -> Span:
        """Lay out calls between two ticks, each behind its gate; return their instructions.

        Those with ``targets`` are made whether their blocks run or not.
        """
        first, self._open = len(self._code), None
        for count, op in enumerate(ops):
            function = self._function(op)
            assert function is not None
            if not targets:
                gate = self._interpreter.program.gate(op.block)
                self._behind(gate, op.targets if op.method == "deriv" else ())
            number = len(self._code)
            self._code.append(self._call(function, op, number, targets[count] if targets else ()))
        self._open = None
        return first, len(self._code)

    def _finish(self) -> None:
        program, memory = self._interpreter.program, self._interpreter.memory
        self.places: Whole = np.array(self._places, np.int64)
        self.code: Whole = np.array(self._code, np.int64).reshape(-1, loop.WIDTH)
        for first, call in self._calls_timed:
            call[PLACES] = self.places.ctypes.data + SLOT * first
        for number, first in self._calls:
            self.code[number, 1] = self.places.ctypes.data + SLOT * first
        for number, gate in self._gates.items():
            self.code[number, 1] = len(self._operands)
            self._operands += gate.operands
        for number, pairs in self._pairs.items():
            self.code[number, 1] = len(self._operands)
            self._operands += (len(pairs), *chain.from_iterable(pairs))
        self.operands: Whole = np.array(self._operands, np.int64)
        self.rhythms: Whole = np.zeros(2 * len(self._rhythms), np.int64)
        self.due: Whole = np.zeros(len(self._rhythms), np.int64)
        self.segments: Whole = np.array(self._segments, np.int64).reshape(-1, 3)
        self.taps: Whole = np.array([(ring.start, ring.room, 0) for ring in self.rings], np.int64).reshape(
            -1, 3
        )
        self.ring: Whole = np.zeros(sum(ring.room * (ring.size + 1) for ring in self.rings), np.int64)
        held = [
            slot.position + index
            for op in dict.fromkeys((*program.minor, *program.renewed))
            for slot in op.targets
            for index in range(slot.size)
        ]
        both = zip(program.states, program.slopes, strict=True)
        self.states: Whole = np.array([*chain.from_iterable(both), *held], np.int64)
        self.stages = stage_numbers(program.solver, float(program.period))
        self.scratch = np.zeros(2 * len(program.states) + len(held))
        if self._events is not None:
            tables, step, crossings, events, renewed = self._events
            arrays: Sequence[NDArray[Any]] = (self.code, self.operands, self.states)
            self.code[step, 1] = tables.finish(
                self._minor[0], self._derivatives[0], crossings, events, renewed, arrays, len(held)
            )
        control = self._control
        if self._clock is not None:
            self._clock_places: Whole = np.array([control.ctypes.data, *self._clock.places], np.int64)
            control[loop.CLOCK] = self._clock.address
            control[loop.CLOCK_PLACES] = self._clock_places.ctypes.data
        control[loop.RHYTHMS], control[loop.SEGMENTS] = len(self._rhythms), len(self.segments)
        control[loop.NUMERATOR], control[loop.DENOMINATOR] = program.period.as_integer_ratio()
        control[loop.TIME] = program.time.position
        control[loop.STATES], control[loop.HELD] = len(program.states), len(held)
        control[loop.STAGES] = len(self.stages)
        control[loop.MINOR], control[loop.DERIVATIVES] = self._minor[0], self._derivatives[0]
        control[loop.CALLS] = self._derivatives[1]
        # One element of a view costs a third of an array's.
        self.control: memoryview = memoryview(cast(Any, control))
        whole: Sequence[NDArray[Any]] = (
            control, self.rhythms, self.due, self.segments, self.code, self.operands, memory.floats,
            memory.floats, self.taps, self.ring, self.states, self.stages, self.scratch,
        )  # fmt: skip
        self._table: Whole = np.array([array.ctypes.data for array in whole], np.int64)
        self.address = int(self._table.ctypes.data)  # of the table of addresses, which the loop takes

    def rows(self) -> Iterator[tuple[Tap, Whole, Whole]]:
        """Yield the taps with rows: their ticks (N,), and their slots (N, size); then the rings are empty."""
        for index, ring in enumerate(self.rings):
            count = int(self.taps[index, 2])
            if count:
                width = ring.size + 1
                rows = self.ring[ring.start : ring.start + count * width].reshape(count, width)
                self.taps[index, 2] = 0
                yield ring.tap, rows[:, 0].copy(), rows[:, 1:].copy()


def _runs(positions: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield the first position and the length of each run of neighbours."""
    start = 0
    for index in range(1, len(positions) + 1):
        if index == len(positions) or positions[index] != positions[index - 1] + 1:
            yield positions[start], index - start
            start = index
