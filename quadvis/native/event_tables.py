"""What the step with events works on: its plan, room for states and values, and their addresses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.interpreter import Interpreter
from quadvis.engine.memory import SLOT
from quadvis.native import event_step
from quadvis.native.stages import stage_numbers

Span = tuple[int, int]  # the first instruction, and the first behind the last


class EventTables:
    """The arrays of `event_step` for one program; they must live as long as it is called.

    MinorError if a block cannot say now how many values its ``crossing`` gives.
    """

    def __init__(self, interpreter: Interpreter) -> None:
        from quadvis.native.library import library

        self._interpreter, self._program = interpreter, interpreter.program
        self._sizes = np.array([interpreter.crossing_size(op) for op in self._program.crossings], np.int64)
        self._begins = np.cumsum(self._sizes) - self._sizes
        self._room = np.zeros((3, int(self._sizes.sum())))  # present, found, above
        self.step = library().routine(event_step.EVENT_STEP)  # its address

    def targets(self, number: int) -> tuple[int, int]:
        """Return the addresses of the size and of the place of the values that a ``crossing`` gives."""
        first = self._room[1].ctypes.data + SLOT * int(self._begins[number])
        return self._sizes.ctypes.data + SLOT * number, first

    def finish(
        self, minor: int, derivatives: int, crossings: Span, events: Sequence[Span], renewed: Span,
        arrays: Sequence[NDArray[Any]], held: int,
    ) -> int:  # fmt: skip
        """Return the address of the table of addresses that the step takes.

        ``arrays`` are the loop's instructions, its operands, and its places of states and of ``held`` slots;
        the instructions of the derivatives end where those of the crossings begin.
        """
        program, memory = self._program, self._interpreter.memory
        code, operands, places = arrays
        count, stages = len(program.states), stage_numbers(program.solver, 1.0)
        plan = [
            count, held, len(stages), len(self._sizes), int(self._sizes.sum()),
            minor, derivatives, *crossings, *renewed,
        ]  # fmt: skip
        saved = 0
        for number, (op, span) in enumerate(zip(program.crossings, events, strict=True)):
            gate, block = program.gate(op.block), program.blocks[op.block]
            where = -1 if gate is None else gate.position
            saved += block.record.size
            plan += [int(self._begins[number]), int(self._sizes[number]), where, *span]
            plan += [block.position, block.record.size]
        flags, states = np.zeros(self._room.shape[1], np.int64), np.zeros((3, count))
        self._kept = [
            np.array(plan, np.int64), code, operands, memory.floats, memory.floats, places,
            np.array([float(program.period), *stages.ravel()]), *states, np.zeros(held), *self._room,
            flags, flags.copy(), np.zeros(saved, np.int64),
        ]  # fmt: skip
        self._table = np.array([array.ctypes.data for array in self._kept], np.int64)
        return int(self._table.ctypes.data)
