"""A program as the numbers that the compiled loop reads: rhythms, segments, instructions, places.

The tables belong to one memory, since they hold addresses in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.interpreter import Call, Interpreter
from quadvis.engine.layout import Placed
from quadvis.engine.memory import SLOT
from quadvis.engine.program import COPY, Op
from quadvis.engine.solver import TABLEAUS
from quadvis.engine.taps import Observer, Tap
from quadvis.native import loop

Rhythm = tuple[int, int]  # ticks from one time to the next, and the first tick
Whole = NDArray[np.int64]
ALWAYS: Rhythm = (1, 0)
ROOM = 1 << 16  # bytes of the rows of one tap
EXACT = 1 << 53  # whole numbers below are exact as floats


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


class Tables:
    """The tables of a program; ``function`` gives the compiled method of a call, or None."""

    def __init__(self, interpreter: Interpreter, function: Callable[[Op], Function | None]) -> None:
        self._interpreter, self._function = interpreter, function
        program, memory = interpreter.program, interpreter.memory
        self._base = memory.floats.ctypes.data
        self._saved: Whole = np.zeros(
            max((block.record.size for block in program.blocks), default=0), np.int64
        )
        self._rhythms: dict[Rhythm, int] = {}
        self._segments: list[list[int]] = []
        self._code: list[tuple[int, ...]] = []
        self._places: list[int] = []  # addresses for calls
        self._calls: list[tuple[int, int]] = []  # instruction, and the index of its first place
        self.python: list[PythonCall] = []
        self.redo: dict[int, Redo] = {}  # by instruction
        self.rings: list[Ring] = []
        self._first_minor = 0  # the instruction of the first call between two ticks
        self._lay_out()
        self._finish()

    @property
    def native(self) -> int:
        """The number of calls that are compiled."""
        return len(self._calls)

    def saved(self, size: int) -> bytes:
        """Return the copy of the record that the last fallible update began with."""
        return self._saved[: size // SLOT].tobytes()

    def waits(self, tick: int) -> None:
        """Set how many ticks each rhythm waits, for a loop that begins at a tick."""
        for index, (every, first) in enumerate(self._rhythms):
            self.rhythms[2 * index : 2 * index + 2] = (
                every,
                first - tick if tick < first else -(tick - first) % every,
            )

    def _lay_out(self) -> None:
        program = self._interpreter.program
        for task, op in program.phase("before"):
            self._op((task.every, task.offset), op)
        for task in program.tasks:
            for first, count in _runs(task.finite):
                self._add((task.every, task.offset), (loop.CHECK, first, count))
        for task, op in program.phase("write"):
            self._op((task.every, task.offset), op)
        for observer in sorted(self._interpreter.observers, key=lambda each: not isinstance(each, Observer)):
            self._observer(observer)
        for task, op in program.phase("update"):
            self._op((task.every, task.offset), op)
        if program.states:
            self._solver()

    def _add(self, rhythm: Rhythm, instruction: tuple[int, ...]) -> int:
        """Add an instruction at a rhythm; return its number."""
        number = self._rhythms.setdefault(rhythm, len(self._rhythms))
        if not self._segments or self._segments[-1][0] != number:
            self._segments.append([number, len(self._code), len(self._code)])
        self._code.append(instruction)
        self._segments[-1][2] = len(self._code)
        return len(self._code) - 1

    def _op(self, rhythm: Rhythm, op: Op) -> None:
        if op.method == COPY and op.sources[0].scalar != "frame":
            source, target = op.sources[0], op.targets[0]
            self._add(rhythm, (loop.COPY, source.position, target.position, source.size))
            return
        python = PythonCall(self._interpreter.call(op), op.block)
        function = None if op.method == COPY else self._function(op)
        if function is None:
            self._ask(rhythm, python)
            return
        record = None
        if function.fallible and op.method == "update":
            block = self._interpreter.program.blocks[op.block]
            record = slice(block.position * SLOT, (block.position + block.record.size) * SLOT)
            saved = (self._saved.ctypes.data - self._base) // SLOT
            self._add(rhythm, (loop.COPY, block.position, saved, block.record.size))
        number = self._add(rhythm, self._call(function, op))
        self._calls.append((number, self._code[number][2]))
        if function.fallible:
            self.redo[number] = Redo(python, record)

    def _call(self, function: Function, op: Op) -> tuple[int, ...]:
        block: Placed = self._interpreter.program.blocks[op.block]
        first = len(self._places)
        positions = [block.position, *(slot.position for slot in (*op.sources, *op.targets))]
        self._places += [self._base + position * SLOT for position in positions]
        return (loop.CALL, function.address, first)

    def _ask(self, rhythm: Rhythm, python: PythonCall) -> int:
        self.python.append(python)
        return self._add(rhythm, (loop.PYTHON, len(self.python) - 1))

    def _observer(self, observer: Tap | Observer) -> None:
        rhythm = self._interpreter.rhythm(observer)
        if isinstance(observer, Observer):
            self._ask(rhythm, PythonCall(None, -1, observer.call))
            return
        row = self._interpreter.program[observer.block].row
        size = (row.stop - row.start) // SLOT
        room = max(1, ROOM // (SLOT * (size + 1)))
        start = self.rings[-1].start + self.rings[-1].room * (self.rings[-1].size + 1) if self.rings else 0
        self._add(rhythm, (loop.ROW, len(self.rings), row.start // SLOT, size))
        self.rings.append(Ring(observer, start, room, size))

    def _solver(self) -> None:
        """Add the solver's step: compiled, if all that it calls is."""
        program = self._interpreter.program
        python = PythonCall(None, -1)
        ops = (*program.minor, *program.derivatives)
        functions = [self._function(op) for op in ops]
        if any(function is None for function in functions):
            self._ask(ALWAYS, python)
            return
        self.redo[self._add(ALWAYS, (loop.INTEGRATE,))] = Redo(python, None)
        self._first_minor = len(self._code)
        for function, op in zip(functions, ops, strict=True):
            assert function is not None
            self._code.append(self._call(function, op))
            self._calls.append((len(self._code) - 1, self._code[-1][2]))

    def _finish(self) -> None:
        program, memory = self._interpreter.program, self._interpreter.memory
        self.places: Whole = np.array(self._places, np.int64)
        self.code: Whole = np.zeros((len(self._code), loop.WIDTH), np.int64)
        for number, instruction in enumerate(self._code):
            self.code[number, : len(instruction)] = instruction
        for number, first in self._calls:
            self.code[number, 2] = self.places.ctypes.data + SLOT * first
        self.rhythms: Whole = np.zeros(2 * len(self._rhythms), np.int64)
        self.due: Whole = np.zeros(len(self._rhythms), np.int64)
        self.segments: Whole = np.array(self._segments, np.int64).reshape(-1, 3)
        self.taps: Whole = np.array([(ring.start, ring.room, 0) for ring in self.rings], np.int64).reshape(
            -1, 3
        )
        self.ring: Whole = np.zeros(sum(ring.room * (ring.size + 1) for ring in self.rings), np.int64)
        self.states: Whole = np.array([*program.states, *program.slopes], np.int64)
        self.stages = _stages(program.solver, float(program.period))
        count, stages = len(program.states), len(self.stages) - 1
        self.scratch = np.zeros(program.held + (2 + stages) * count)
        control = np.zeros(loop.CONTROLS, np.int64)
        control[loop.RHYTHMS], control[loop.SEGMENTS] = len(self._rhythms), len(self.segments)
        control[loop.NUMERATOR], control[loop.DENOMINATOR] = program.period.as_integer_ratio()
        control[loop.STATES], control[loop.HELD], control[loop.STAGES] = count, program.held, stages
        first = self._first_minor
        control[loop.MINOR], control[loop.MINORS] = first, len(program.minor)
        control[loop.DERIVATIVES] = first + len(program.minor)
        control[loop.DERIVATIVE_COUNT] = len(program.derivatives)
        self._control = control
        # One element of a view costs a third of an array's.
        self.control: memoryview = memoryview(cast(Any, control))
        arrays: Sequence[NDArray[Any]] = (
            control, self.rhythms, self.due, self.segments, self.code, memory.floats, memory.floats,
            self.taps, self.ring, self.states, self.stages, self.scratch,
        )  # fmt: skip
        self.table: Whole = np.array([array.ctypes.data for array in arrays], np.int64)

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


def _stages(solver: str, step: float) -> NDArray[np.float64]:
    """Return a row for each stage: its node (s), and its weights; then one for the result."""
    tableau = TABLEAUS[solver]
    count = len(tableau.nodes)
    found = np.zeros((count + 1, count + 1))
    rows = zip((*tableau.nodes, 1.0), (*tableau.stages, tableau.weights), strict=True)
    for index, (node, weights) in enumerate(rows):
        found[index, 0] = node * step
        found[index, 1 : 1 + len(weights)] = [step * weight for weight in weights]
    return found
