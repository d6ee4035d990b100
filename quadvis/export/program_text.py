"""A program as C: its memory at first, its variables, and what is called when."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby

import numpy as np

from quadvis.engine.memory import Slot
from quadvis.engine.program import COPY, RESET, Op, Program, TaskProgram
from quadvis.export.c_types import real
from quadvis.export.selection import HELD
from quadvis.export.selection import INPUT as FROM_OUTSIDE
from quadvis.export.variables import INPUT, KINDS, OUTPUT, ExportedVariable
from quadvis.graph.graph import Graph
from quadvis.native.stages import stage_numbers

SLOT = 8
_LETTERS = {INPUT: "i", OUTPUT: "o"}


def program_header(
    program: Program, variables: Sequence[ExportedVariable], undone: Sequence[int], token: str
) -> str:
    """Return program.h: what the other files need to know of a program."""
    settable = sum(len(each.slots) for each in variables if each.role != OUTPUT)
    held = len(_held(program))
    numerator, denominator = program.period.as_integer_ratio()
    facts = {
        "SLOTS": len(program.image) // SLOT,
        "VARIABLES": len(variables),
        "SETTABLE": settable,
        "STATES": len(program.states),
        "HELD": held,
        "UNDONE": len(undone),
        "STAGES": len(stage_numbers(program.solver, float(program.period))) if program.states else 0,
        "PERIOD_ABOVE": f"INT64_C({numerator})",
        "PERIOD_BELOW": f"INT64_C({denominator})",
    }
    lines = [f"#define {name} {value}" for name, value in facts.items()]
    return "\n".join([f'#define TOKEN "{token}"', *lines]) + "\n"


def program_calls(
    program: Program,
    variables: Sequence[ExportedVariable],
    undone: Sequence[int],
    names: Mapping[tuple[int, str], str],
) -> str:
    """Return calls.h. ``names`` are the C functions by the number of a block and its method."""
    return "\n".join([*_tables(program, variables, undone), *_Calls(program, names).lines()]) + "\n"


def _held(program: Program) -> list[int]:
    """Return the slots over which minor steps write."""
    return [
        slot.position + index for op in program.minor for slot in op.targets for index in range(slot.size)
    ]


def undone_slots(program: Program, graph: Graph) -> list[int]:
    """Return the slots that are set back before inputs are set once more at one tick.

    All others are computed anew from what is set. But a block whose condition has become false leaves its
    outputs as they are, and a reset that is none after all has set states back and drawn random numbers.
    """
    found: list[Slot] = []
    for number, (block, node) in enumerate(zip(program.blocks, graph.nodes, strict=True)):
        if program.gate(number) is not None:
            found += [*block.outputs.values(), *map(block.field, node.block.interface.streams)]
    found += [slot for task in program.tasks for op in task.resets for slot in op.targets]
    return sorted({slot.position + index for slot in found for index in range(slot.size)})


def _tables(program: Program, variables: Sequence[ExportedVariable], undone: Sequence[int]) -> Iterator[str]:
    words = np.frombuffer(program.image, np.uint64)
    cells = ", ".join(f"[{place}] = UINT64_C({value})" for place, value in enumerate(words.tolist()) if value)
    yield f"static const uint64_t image[SLOTS] = {{{cells or '0'}}};"
    places = [slot for each in variables for slot in each.slots]
    yield f"const int32_t model_places[] = {_whole(places)};"
    rows, first = [], 0
    for each in variables:
        limits = f"{_limit(each.least)}, {_limit(each.most)}"
        letter = _LETTERS.get(each.role, "p")
        rows.append(f"{{{first}, {len(each.slots)}, '{KINDS[each.scalar]}', '{letter}', {limits}}}")
        first += len(each.slots)
    yield f"const Variable model_variables[] = {{{', '.join(rows) or '{0, 0, 0, 0, 0.0, 0.0}'}}};"
    yield f"static const int32_t state_slots[STATES + 1] = {_whole(program.states)};"
    yield f"static const int32_t slope_slots[STATES + 1] = {_whole(program.slopes)};"
    yield f"static const int32_t held_slots[HELD + 1] = {_whole(_held(program))};"
    yield f"static const int32_t undone_slots[UNDONE + 1] = {_whole(undone)};"
    numbers = stage_numbers(program.solver, float(program.period)) if program.states else np.zeros((0, 3))
    stages = [f"{{{', '.join(map(real, row))}}}" for row in numbers.tolist()]
    yield f"static const double stages[STAGES + 1][3] = {{{', '.join(stages) or '{0.0, 0.0, 0.0}'}}};"


def _whole(numbers: Iterable[int]) -> str:
    return f"{{{', '.join(map(str, numbers)) or '0'}}}"


def _limit(value: float) -> str:
    return real(value) if np.isfinite(value) else "INFINITY" if value > 0 else "-INFINITY"


class _Calls:
    """Writes the calls of each phase."""

    def __init__(self, program: Program, names: Mapping[tuple[int, str], str]) -> None:
        self._program, self._names = program, names

    def lines(self) -> Iterator[str]:
        """Yield the functions."""
        program = self._program
        yield from self._function("starts", [(None, self._start(k)) for k in range(len(program.blocks))])
        delays = [(task, self._copy(op)) for task in program.tasks for op in task.delays]
        yield from self._function("delays", delays)
        before = [(task, self._op(op)) for task, op in program.phase("before") if op.method != COPY]
        yield from self._function("outputs", before)
        yield from self._function(
            "checks", [(task, line) for task in program.tasks for line in self._checks(task)]
        )
        yield from self._function("updates", [(task, self._op(op)) for task, op in program.phase("update")])
        yield from self._function("minor", [(None, self._op(op)) for op in program.minor])
        yield from self._function("derivatives", [(None, self._op(op)) for op in program.derivatives])

    def _function(self, name: str, calls: Sequence[tuple[TaskProgram | None, str]]) -> Iterator[str]:
        """Yield a function that makes calls, each when its task is due."""
        yield f"static int call_{name}(Model *m) {{"
        yield "    (void)m;"
        for task, group in groupby(calls, key=lambda pair: pair[0]):
            lines = [line for _, line in group if line]
            if not lines:
                continue
            if task is None or (task.every, task.offset) == (1, 0):
                yield from (f"    {line}" for line in lines)
            else:
                yield f"    if (due(m, {task.every}, {task.offset})) {{ /* {_comment(task.name)} */"
                yield from (f"        {line}" for line in lines)
                yield "    }"
        yield "    return 0;"
        yield "}"

    def _start(self, number: int) -> str:
        name = self._names.get((number, "start"))
        block = self._program.blocks[number]
        return f'CALL({_text(block.path)}, "start", {name}, at(m, {block.position}));' if name else ""

    def _op(self, op: Op) -> str:
        block = self._program.blocks[op.block]
        if block.kind == FROM_OUTSIDE:
            return self._copy(op._replace(sources=(block.field(HELD),)))
        if op.method == RESET:
            return self._reset(op)
        places = [block.position, *(slot.position for slot in (*op.sources, *op.targets))]
        arguments = ", ".join(f"at(m, {place})" for place in places)
        name = self._names[op.block, op.method]
        call = f'CALL({_text(block.path)}, "{op.method}", {name}, {arguments});'
        gate = self._program.gate(op.block)
        if gate is None:
            return call
        zeros = _zeros(op.targets) if op.method == "deriv" else ""
        return f"if (*at(m, {gate.position})) {call}" + (f" else {{ {zeros} }}" if zeros else "")

    def _reset(self, op: Op) -> str:
        """Return what sets the states under a condition back, if it says so."""
        runs = _runs(sorted({slot.position + index for slot in op.targets for index in range(slot.size)}))
        back = [f"memcpy(at(m, {first}), &image[{first}], {SLOT * count});" for first, count in runs]
        starts = filter(None, map(self._start, self._program.members(op.block)))
        return f"if (*at(m, {op.sources[0].position})) {{ {' '.join([*back, *starts])} }}"

    @staticmethod
    def _copy(op: Op) -> str:
        source, target = op.sources[0], op.targets[0]
        return f"memcpy(at(m, {target.position}), at(m, {source.position}), {SLOT * source.size});"

    def _checks(self, task: TaskProgram) -> Iterator[str]:
        """Yield the checks that the outputs of a task's blocks are finite."""
        for block in self._program.blocks:
            if block.task != task.name:
                continue
            for port, slot in block.outputs.items():
                if slot.scalar == "float64" and port not in block.nan:
                    yield f"CHECK({_text(block.path)}, {_text(port)}, {slot.position}, {slot.size});"


def _zeros(slots: Iterable[Slot]) -> str:
    return " ".join(f"memset(at(m, {slot.position}), 0, {SLOT * slot.size});" for slot in slots)


def _runs(places: Iterable[int]) -> Iterator[tuple[int, int]]:
    """Yield the first and the number of each run of places that follow on each other."""
    for _, group in groupby(enumerate(places), key=lambda pair: pair[1] - pair[0]):
        run = [place for _, place in group]
        yield run[0], len(run)


def _text(name: str) -> str:
    """Return a text of C; names have no characters that would need more."""
    return '"' + "".join(letter if letter.isalnum() or letter in "_/. " else "_" for letter in name) + '"'


def _comment(name: str) -> str:
    return name.replace("*/", "")
