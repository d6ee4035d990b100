"""A program as text: the calls of each tick in order, with their signals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from quadvis.engine.layout import NO_BLOCK, TIME
from quadvis.engine.memory import Slot
from quadvis.engine.program import Op, Program
from quadvis.machine.columns import table
from quadvis.units import Unit, format_quantity

SECOND = Unit.parse("s")
Row = tuple[str, ...]


def program_lines(program: Program) -> list[str]:
    """Return the lines of the table: each task with its phases, then the calls of the solver."""
    names = _Names(program)
    slots = len(program.image) // 8
    lines = [
        f"{program.name}: base tick {_time(float(program.period))}, {program.solver}, "
        f"{program.tasking} tasking, {len(program.blocks)} blocks, {slots} slots of 8 bytes, "
        f"{program.frames} frames",
        f"program {program.hash[:16]}, memory at the beginning included",
    ]
    rows: list[Row] = []
    for task in program.tasks:
        often = "every tick" if task.every == 1 else f"every {task.every} ticks"
        offset = f" from tick {task.offset} on" if task.offset else ""
        rows.append((f"task {task.name}", f"{often}{offset}, {_time(float(task.period))}", "", "", ""))
        before = ("delay", task.delays), ("latch", task.latches), ("reset", task.resets)
        for phase, ops in (*before, *task.phases.items()):
            rows += _phase(phase, ops, names)
    for title, ops in (("derivatives", program.derivatives), ("minor steps", program.minor)):
        if ops:
            rows.append((title, f"{program.solver}, between ticks", "", "", ""))
            rows += _phase("", ops, names)
    lines += ["", *_sections(rows)]
    if program.tunables:
        found = [
            (f"  {each.path}.{each.name}", each.unit, f"slot {each.slot.position}")
            for each in program.tunables
        ]
        lines += ["", "tunable between ticks", *table(found)]
    return lines


def _sections(rows: Iterable[Row]) -> Iterator[str]:
    """Yield aligned rows, each title on its own line after a blank line."""
    body = [row for row in rows if row[0].startswith(" ")]
    aligned = iter(table(body))
    first = True
    for row in rows:
        if row[0].startswith(" "):
            yield next(aligned)
        else:
            yield from ([] if first else [""])
            yield f"{row[0]}: {row[1]}"
        first = False


def _phase(phase: str, ops: Iterable[Op], names: _Names) -> Iterator[Row]:
    for op in ops:
        path = "" if op.block == NO_BLOCK else names.program.blocks[op.block].path
        reads = ", ".join(names.of(slot) for slot in op.sources)
        writes = ", ".join(names.of(slot).replace(f"{path}.", "", 1) for slot in op.targets)
        number = "" if op.block == NO_BLOCK else str(op.block)
        gate = names.program.gate(op.block)
        reads += f"{', ' if reads else ''}while {names.of(gate)}" if gate is not None else ""
        yield f"  {phase or op.method}", number, path or op.method, reads, f"-> {writes}" if writes else ""


class _Names:
    """The names of the slots of a program."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self._frames: dict[int, str] = {}
        self._slots: dict[int, tuple[str, Slot, int]] = {}
        for block in program.blocks:
            for port, slot in block.outputs.items():
                self._name(f"{block.path}.{port}", slot)
            for field in block.record.fields if block.condition != NO_BLOCK else ():
                self._name(f"{block.path}.{field.name}", block.field(field.name))
            for state, slot in block.slopes.items():
                self._name(f"d/dt {block.path}.{state}", slot)
        for task in program.tasks:
            for word, ops in (("delayed", task.delays), ("latched", task.latches)):
                for op in ops:
                    self._name(f"{word} {self.of(op.sources[0])}", op.targets[0])

    def _name(self, name: str, slot: Slot) -> None:
        if slot.scalar == "frame":
            self._frames[slot.position] = name
            return
        for element in range(slot.size):
            self._slots[slot.position + element] = (name, slot, element)

    def of(self, slot: Slot) -> str:
        """Return the signal of a slot, with an index if necessary; or the value of a constant."""
        if slot == TIME:
            return "time"
        if slot.scalar == "frame":
            return self._frames.get(slot.position, "no frame")
        if slot.position not in self._slots:
            return self._constant(slot)
        name, whole, element = self._slots[slot.position]
        if slot.size == whole.size:
            return name
        first = np.unravel_index(element, whole.shape)
        index = ",".join(str(int(each)) for each in first)
        return f"{name}[{index}]" if slot.size == 1 else f"{name}[{index}...]"

    def _constant(self, slot: Slot) -> str:
        values = np.frombuffer(self.program.image, np.float64)[slot.position : slot.position + slot.size]
        if slot.scalar != "float64":
            values = values.view(np.int64)
        shown = ", ".join(f"{value:g}" for value in values[:4].tolist())
        return f"[{shown}{', ...' if slot.size > 4 else ''}]" if slot.shape else shown


def _time(seconds: float) -> str:
    return format_quantity(seconds, SECOND) if math.isfinite(seconds) else "?"
