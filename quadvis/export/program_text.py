"""A program as C: its memory at first, its variables, and what is called when."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import accumulate, groupby

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.events import LOCATED, MOST, NEVER, PARTS, TRIES
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
    program: Program,
    variables: Sequence[ExportedVariable],
    undone: Sequence[int],
    sizes: Sequence[int],
    token: str,
) -> str:
    """Return program.h: what the other files need to know of a program.

    ``sizes`` are the numbers of values by which the blocks with events say where these are.
    """
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
        "EVENTS": len(sizes),
        "VALUES": sum(sizes),
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
    sizes: Sequence[int],
) -> str:
    """Return calls.h. ``names`` are the C functions by the number of a block and its method."""
    lines = [*_tables(program, variables, undone), *_Calls(program, names).lines()]
    if sizes:
        lines += [*_event_tables(program, sizes), *_Calls(program, names).events(sizes)]
    return "\n".join(lines) + "\n"


def _event_tables(program: Program, sizes: Sequence[int]) -> Iterator[str]:
    limits = {"LOCATED": real(LOCATED), "MOST": MOST, "PARTS": PARTS, "TRIES": TRIES, "NEVER": real(NEVER)}
    yield from (f"#define {name} {value}" for name, value in limits.items())
    yield f"static const int64_t event_sizes[EVENTS] = {_whole(sizes)};"
    yield f"static const int32_t first_value[EVENTS + 1] = {_whole([0, *accumulate(sizes)])};"
    yield f"static const double formula_step = {real(float(program.period))};"
    yield f"static const double formula[STAGES][3] = {_rows(stage_numbers(program.solver, 1.0))};"


def _held(program: Program) -> list[int]:
    """Return the slots over which minor steps write."""
    ops = dict.fromkeys((*program.minor, *(program.renewed if program.states else ())))
    return [slot.position + index for op in ops for slot in op.targets for index in range(slot.size)]


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
    yield f"static const double stages[STAGES + 1][3] = {_rows(numbers)};"


def _rows(numbers: NDArray[np.float64]) -> str:
    rows = [f"{{{', '.join(map(real, row))}}}" for row in numbers.tolist()]
    return f"{{{', '.join(rows) or '{0.0, 0.0, 0.0}'}}}"


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

    def events(self, sizes: Sequence[int]) -> Iterator[str]:
        """Yield the functions that steps with events call; ``sizes`` as in `program_header`."""
        program = self._program
        yield "static int call_crossings(Model *m, double *found) {"
        for number, op in enumerate(program.crossings):
            size, first = sizes[number], sum(sizes[:number])
            never = f"for (int k = 0; k < {size}; k++) found[{first} + k] = NEVER;"
            call = self._op(op, f"(char *)&event_sizes[{number}]", f"(char *)&found[{first}]", rests=never)
            yield f"    {call}"
        yield "    return 0;"
        yield "}"
        yield "static int call_event(Model *m, int number) {"
        for number, op in enumerate(program.events):
            yield f"    if (number == {number}) {self._op(op)}"
        yield "    return 0;"
        yield "}"
        yield from self._function("renewed", [(None, self._op(op)) for op in program.renewed])

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

    def _op(self, op: Op, *targets: str, rests: str = "") -> str:
        """Return a call; ``targets`` are addresses outside of memory to which it writes.

        ``rests`` is what happens in its place while the block does not run.
        """
        block = self._program.blocks[op.block]
        if block.kind == FROM_OUTSIDE:
            return self._copy(op._replace(sources=(block.field(HELD),)))
        if op.method == RESET:
            return self._reset(op)
        places = [block.position, *(slot.position for slot in (*op.sources, *op.targets))]
        arguments = ", ".join([*(f"at(m, {place})" for place in places), *targets])
        name = self._names[op.block, op.method]
        call = f'CALL({_text(block.path)}, "{op.method}", {name}, {arguments});'
        gate = self._program.gate(op.block)
        if gate is None:
            return call
        rests = _zeros(op.targets) if op.method == "deriv" else rests
        return f"if (*at(m, {gate.position})) {call}" + (f" else {{ {rests} }}" if rests else "")

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
