"""The program: all that a loop needs to run a graph, as pure data.

A program can be pickled, hashed, compared and printed. It knows no block object and no memory: an
executor binds it to both. The interpreter, the compiled loop, a process on a target, replay and scopes
run one program.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

from quadvis.block.interface import CROSSING, EVENT
from quadvis.block.random import stream_start
from quadvis.engine.layout import NO_BLOCK, TIME, Layout, Placed
from quadvis.engine.memory import Memory, Slot
from quadvis.graph.graph import ACTIVE, RESTART, SINGLE, USUAL, Constant, Graph, Node, Tolerances
from quadvis.machine.garbage import uncollected

COPY, RESET = "copy", "reset"
PHASES = ("read", "output", "write", "update")


class Op(NamedTuple):
    """One call of a block's method, from slots to slots; or the copy of one slot to another.

    ``block`` is the block's number in the program, the order of execution; a copy has ``NO_BLOCK``. A `RESET`
    follows on the output of a condition: if the source is true, the targets, states of the blocks under the
    condition, have their initial values again.
    """

    block: int
    method: str
    sources: tuple[Slot, ...]
    targets: tuple[Slot, ...]


class TaskProgram(NamedTuple):
    """The calls of the blocks of one rate at each of their ticks, phase by phase.

    The task is due at tick ``offset`` and then at every ``every`` ticks. ``delays``: copies of outputs of one
    period ago, made before any block runs. ``latches``: copies of what faster tasks gave, made once those are
    through, where each task runs by itself. ``reads``: blocks fetch what the world outside offers.
    ``outputs``: the blocks compute. ``finite``: the slots that must hold finite numbers then. ``writes``:
    blocks hand their inputs to the world outside. ``updates``: the blocks change their states. ``time`` is
    where the blocks read the time of the tick; one of the latches copies it, where it is the task's own.
    ``resets`` set states back among the outputs.
    """

    name: str
    period: Fraction  # s
    every: int
    offset: int
    continuous: bool
    delays: tuple[Op, ...]
    latches: tuple[Op, ...]
    reads: tuple[Op, ...]
    outputs: tuple[Op, ...]
    writes: tuple[Op, ...]
    updates: tuple[Op, ...]
    finite: tuple[int, ...]
    time: Slot = TIME
    resets: tuple[Op, ...] = ()

    @property
    def phases(self) -> dict[str, tuple[Op, ...]]:
        """The calls of the blocks by their method, in the order of the phases."""
        return {"read": self.reads, "output": self.outputs, "write": self.writes, "update": self.updates}


class Tunable(NamedTuple):
    """A parameter that may change between two ticks of a run."""

    block: int
    path: str
    name: str
    unit: str
    slot: Slot


@dataclass(frozen=True)
class Program:
    """The program of one graph and one seed.

    ``tasking`` is ``single``: all blocks that are due run in one order; or ``multi``: task by task, fastest
    first. ``blocks`` are in the order of execution, ``tasks`` fastest first. ``image`` is the memory at the
    beginning: parameters, initial states, constants, random streams. ``held`` is the number of slots that
    minor steps write over: time and the signals of the continuous task. ``states`` are the slots of the
    continuous states, ``slopes`` those of their derivatives, in one order. ``derivatives`` are the calls that
    give them; ``minor`` are the outputs on which they depend and which move between two ticks. A tick begins
    with its time in ``time``. ``tolerances`` are those of a solver of variable step. ``crossings`` and
    ``events`` are the methods of blocks with events between ticks, in one order, and ``renewed`` the outputs
    that are computed anew after one.
    """

    name: str
    period: Fraction  # of the base tick (s)
    solver: str
    tasking: str
    tasks: tuple[TaskProgram, ...]
    blocks: tuple[Placed, ...]
    image: bytes
    frames: int
    held: int
    states: tuple[int, ...]
    slopes: tuple[int, ...]
    derivatives: tuple[Op, ...]
    minor: tuple[Op, ...]
    tunables: tuple[Tunable, ...]
    time: Slot = TIME
    tolerances: Tolerances = USUAL
    crossings: tuple[Op, ...] = ()
    events: tuple[Op, ...] = ()
    renewed: tuple[Op, ...] = ()

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {block.path: number for number, block in enumerate(self.blocks)}

    def number(self, path: str) -> int:
        """Return the number of a block; KeyError if no block has this path."""
        return self._numbers[path]

    def __getitem__(self, path: str) -> Placed:
        return self.blocks[self._numbers[path]]

    def op(self, path: str, method: str) -> Op | None:
        """Return the call of a block's method, such as ``output``; None if it has no such method."""
        number = self.number(path)
        task = self.task(self.blocks[number].task)
        ops = {"deriv": self.derivatives, **task.phases}[method]
        return next((op for op in ops if op.block == number), None)

    def task(self, name: str) -> TaskProgram:
        """Return a task by its name."""
        return next(task for task in self.tasks if task.name == name)

    @cached_property
    def conditions(self) -> frozenset[int]:
        """The blocks that say when others run."""
        return frozenset(block.condition for block in self.blocks) - {NO_BLOCK}

    def gate(self, block: int) -> Slot | None:
        """Return the slot that is true when a block runs; None if it runs at all ticks of its task."""
        condition = self.blocks[block].condition if block != NO_BLOCK else NO_BLOCK
        if condition == NO_BLOCK or block in self.conditions:
            return None
        return self.blocks[condition].outputs[ACTIVE]

    def members(self, condition: int) -> list[int]:
        """Return the blocks under a condition, and those under conditions in it."""
        found = {condition}
        for number in range(condition + 1, len(self.blocks)):  # a condition is before its blocks
            if self.blocks[number].condition in found:
                found.add(number)
        return sorted(found - {condition})

    def phase(self, name: str) -> tuple[tuple[TaskProgram, Op], ...]:
        """Return all calls of a phase in the order of one tick, each with its task.

        ``before``: copies, reads and outputs; ``write``; ``update``. A tick leaves out what is not due.
        """
        groups = [self.tasks] if self.tasking == SINGLE else [(task,) for task in self.tasks]
        if name != "before":
            return tuple(pair for group in groups for pair in _in_order(group, name))
        found = [(task, op) for task in self.tasks for op in task.delays]
        for group in groups:
            found += [(task, op) for task in group for op in task.latches]
            found += self._before(group)
        return tuple(found)

    def _before(self, group: Sequence[TaskProgram]) -> Iterator[tuple[TaskProgram, Op]]:
        """Yield the reads of some tasks, then the outputs.

        Among these are resets, and the reads of blocks of which only then is known whether they run.
        """
        reads = _in_order(group, "read")
        yield from (pair for pair in reads if self.gate(pair[1].block) is None)
        late = [pair for pair in reads if self.gate(pair[1].block) is not None]
        resets = [(task, op) for task in group for op in task.resets]
        if not late and not resets:
            yield from _in_order(group, "output")
        else:
            yield from sorted([*late, *_in_order(group, "output"), *resets], key=lambda pair: pair[1].block)

    def part(self, name: str) -> Program:
        """Return what the thread of one task runs.

        The delays and latches of all but the fastest are left to those who dispatch them.
        """
        task = self.task(name)
        if task == self.tasks[0]:
            return replace(self, tasks=(task,))
        alone = task._replace(delays=(), latches=())
        return replace(
            self, tasks=(alone,), held=0, states=(), slopes=(), derivatives=(), minor=(), time=task.time,
            crossings=(), events=(), renewed=(),
        )  # fmt: skip

    def quiet(self, left_out: Set[int]) -> Program:
        """Return what runs without effects outside: without reads and writes, and without some blocks.

        These are given by their numbers. Numbers that are not finite are not refused. All other blocks run,
        whatever their conditions say.
        """

        def without(ops: Iterable[Op]) -> tuple[Op, ...]:
            return tuple(op for op in ops if op.block not in left_out)

        tasks = [
            task._replace(
                reads=(), writes=(), finite=(), resets=(),
                outputs=without(task.outputs), updates=without(task.updates),
            )
            for task in self.tasks
        ]  # fmt: skip
        derivatives, minor = without(self.derivatives), without(self.minor)
        blocks = tuple([replace(block, condition=NO_BLOCK) for block in self.blocks])
        return replace(
            self, tasks=tuple(tasks), blocks=blocks, derivatives=derivatives, minor=minor,
            crossings=without(self.crossings), events=without(self.events), renewed=without(self.renewed),
        )  # fmt: skip

    @cached_property
    def hash(self) -> str:
        """The SHA-256 of everything in the program."""
        return hashlib.sha256(repr(self).encode()).hexdigest()


@uncollected()
def make_program(graph: Graph, seed: int) -> Program:
    """Lay out memory and list the calls of every task; states hold their initial values, seeded."""
    layout = Layout(graph)
    blocks = layout.blocks
    calls = _calls(graph, blocks, layout.times)
    resets = dict(_resets(graph, layout))
    numbers: dict[str, list[int]] = {task.name: [] for task in graph.tasks}
    for number, block in enumerate(blocks):
        numbers[block.task].append(number)
    tasks = []
    for task in graph.tasks:
        mine, time = numbers[task.name], layout.times.get(task.name, TIME)
        read, output, write, update = (
            tuple(calls[phase][number] for number in mine if number in calls[phase]) for phase in PHASES
        )
        tasks.append(
            TaskProgram(
                task.name,
                task.period,
                graph.ticks(task.period),
                graph.ticks(task.offset),
                task.continuous,
                _copies(layout.delays.get(task.name, ())),
                (
                    *_copies([(TIME, time)] if time != TIME else ()),
                    *_copies(layout.latches.get(task.name, ())),
                ),
                read,
                output,
                write,
                update,
                tuple(position for number in mine for position in _finite(blocks[number])),
                time,
                tuple(resets[number] for number in mine if number in resets),
            )
        )
    crossings, events, renewed = _event_calls(graph, blocks)
    states = [(block.field(name), slope) for block in blocks for name, slope in block.slopes.items()]
    return Program(
        graph.name,
        graph.tick,
        graph.solver,
        graph.tasking,
        tuple(tasks),
        blocks,
        _image(graph, layout, seed),
        layout.frames,
        layout.continuous,
        tuple(_elements(state for state, _ in states)),
        tuple(_elements(slope for _, slope in states)),
        tuple(calls["deriv"].values()),
        tuple(calls["output"][number] for number in _minor(graph.nodes) if number in calls["output"]),
        tuple(_tunables(graph, blocks)),
        tolerances=graph.tolerances,
        crossings=crossings,
        events=events,
        renewed=renewed,
    )


def _event_calls(
    graph: Graph, blocks: Sequence[Placed]
) -> tuple[tuple[Op, ...], tuple[Op, ...], tuple[Op, ...]]:
    """Return what finds events between ticks, what they do, and what is to be computed anew after one."""
    found: dict[str, list[Op]] = {CROSSING: [], EVENT: []}
    renewed: list[Op] = []
    changed: set[str] = set()
    moving = _moving(graph.nodes)
    for number, (node, block) in enumerate(zip(graph.nodes, blocks, strict=True)):
        interface = node.block.interface
        if not node.task.continuous:
            continue
        for method, names in interface.events.items():
            sources = tuple(TIME if name == "time" else block.inputs[name] for name in names)
            found[method].append(Op(number, method, sources, ()))
        follows = node.block.numeric and "update" not in interface.arguments and not node.block.stepwise
        follows = follows and not changed.isdisjoint(_sources(node, interface.feedthrough))
        if interface.events or follows or node.path in moving:
            changed |= {node.path} if interface.events or follows else set()
            names = interface.arguments.get("output", ())
            sources = tuple(TIME if name == "time" else block.inputs[name] for name in names)
            renewed.append(Op(number, "output", sources, tuple(block.outputs.values())))
    return tuple(found[CROSSING]), tuple(found[EVENT]), tuple(renewed) if found[CROSSING] else ()


def _in_order(tasks: Sequence[TaskProgram], phase: str) -> list[tuple[TaskProgram, Op]]:
    """Return the calls of a phase of several tasks in the order of execution."""
    return sorted(((task, op) for task in tasks for op in task.phases[phase]), key=lambda pair: pair[1].block)


def _copies(slots: Iterable[tuple[Slot, Slot]]) -> tuple[Op, ...]:
    return tuple(Op(NO_BLOCK, COPY, (source,), (target,)) for source, target in slots)


def _resets(graph: Graph, layout: Layout) -> Iterator[tuple[int, Op]]:
    """Yield the resets under conditions, by the numbers of these.

    What is reset are the states of the blocks of its rate, random streams excepted, and their delayed values.
    """
    numbers = {node.path: number for number, node in enumerate(graph.nodes)}
    for path, nodes in graph.conditions.items():
        placed = layout.blocks[numbers[path]]
        targets = [slot for node in nodes for slot in _states(node, layout.blocks[numbers[node.path]])]
        inside = [path, *(node.path for node in nodes)]
        targets += [slot for each in inside for slot in layout.kept.get(each, ())]
        if targets:
            yield numbers[path], Op(numbers[path], RESET, (placed.outputs[RESTART],), tuple(targets))


def _states(node: Node, block: Placed) -> Iterator[Slot]:
    """Yield the slots of the states that a reset sets back."""
    interface = node.block.interface
    for name in interface.states:
        if name not in interface.streams:
            yield block.field(name)


def _calls(graph: Graph, blocks: Sequence[Placed], times: Mapping[str, Slot]) -> dict[str, dict[int, Op]]:
    """Return the calls of each method by the number of the block."""
    found: dict[str, dict[int, Op]] = {method: {} for method in (*PHASES, "deriv")}
    for number, (node, block) in enumerate(zip(graph.nodes, blocks, strict=True)):
        targets = {"output": tuple(block.outputs.values()), "deriv": tuple(block.slopes.values())}
        for method, names in node.block.interface.arguments.items():
            if method in found:
                time = times.get(block.task, TIME)
                sources = tuple([time if name == "time" else block.inputs[name] for name in names])
                found[method][number] = Op(number, method, sources, targets.get(method, ()))
    return found


def _finite(block: Placed) -> Iterator[int]:
    """Yield the slots that must hold finite numbers once a block has run."""
    for name, slot in block.outputs.items():
        if slot.scalar == "float64" and name not in block.nan:
            yield from range(slot.position, slot.position + slot.size)


def _elements(slots: Iterable[Slot]) -> Iterator[int]:
    """Yield the position of every element."""
    for slot in slots:
        yield from range(slot.position, slot.position + slot.size)


def _image(graph: Graph, layout: Layout, seed: int) -> bytes:
    """Return the memory at the beginning of a run."""
    memory = Memory(layout.size)
    for node, block in zip(graph.nodes, layout.blocks, strict=True):
        memory.fill(node.block, block.record, block.position, float(node.task.period))
        for port, source in node.inputs.items():
            if isinstance(source, Constant) and block.inputs[port].scalar != "frame":
                memory.write(block.inputs[port], source.value)
        for name in node.block.interface.streams:
            memory.write(block.field(name), stream_start(seed, f"{node.stream or node.path}.{name}"))
    return bytes(memory.raw)


def _tunables(graph: Graph, blocks: Sequence[Placed]) -> Iterator[Tunable]:
    for number, (node, block) in enumerate(zip(graph.nodes, blocks, strict=True)):
        for name, param in node.block.interface.params.items():
            if param.tune and not param.is_text:
                yield Tunable(number, node.path, name, param.unit, block.field(name))


def _minor(nodes: Sequence[Node]) -> list[int]:
    """Return the blocks that minor steps must compute again, in the order of execution."""
    needed: set[str] = set()
    for node in nodes:
        needed.update(_sources(node, node.block.interface.arguments.get("deriv", ())))
        for names in node.block.interface.events.values() if node.task.continuous else ():
            needed.update(_sources(node, names))
    moving = _moving(nodes)
    found: list[int] = []
    for number, node in reversed(list(enumerate(nodes))):
        if node.path in needed and node.path in moving:
            found.append(number)
            needed.update(_sources(node, node.block.interface.feedthrough))
    return found[::-1]


def _moving(nodes: Sequence[Node]) -> set[str]:
    """Return the blocks whose outputs move between two ticks.

    They are in the continuous task, and have continuous states, or follow time or another moving block. A
    block that has an ``update`` and passes its input on is a sampled one: its output stands still until the
    next tick. So does that of a block which is not numeric, since it may reach outside, and of one that says
    it is ``stepwise``.
    """
    found: set[str] = set()
    for node in nodes:
        interface = node.block.interface
        if not node.task.continuous or node.block.stepwise:
            continue
        follows = "time" in interface.arguments.get("output", ())
        if "update" not in interface.arguments:
            follows |= not found.isdisjoint(_sources(node, interface.feedthrough))
        if interface.continuous or (node.block.numeric and follows):
            found.add(node.path)
    return found


def _sources(node: Node, ports: Iterable[str]) -> Iterator[str]:
    """Yield the blocks whose present outputs some inputs of a block read."""
    return (wire.block for _, wire in node.wires(ports) if not wire.delayed)
