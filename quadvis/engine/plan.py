"""From a checked graph to something that runs: one memory layout and flat lists of calls.

Layout, in 8-byte slots: time | signals, task by task (the continuous one first), block by block | constants |
delayed signals | slopes | one record per block. A block's outputs lie side by side: a row of the log is one
slice. The native tier is meant to run the same plan.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block import NO_FRAME, Block, Random, Shape
from quadvis.engine.graph import Constant, Graph, Node, Wire, selected
from quadvis.engine.memory import SLOT, Memory, Record, Slot

Call = Callable[[], None]
Positions = NDArray[np.intp]  # in ``Memory.floats``
TIME = Slot("float64", (), 0)
STREAM_MODULUS = 4294944443  # the smaller of the two moduli of MRG32k3a: every seed below it is valid


@dataclass(eq=False)
class Bound:
    """A block in its place: ``self`` over memory, slots of inputs, outputs and derivatives, its calls."""

    node: Node
    self: Block
    inputs: dict[str, Slot]
    outputs: dict[str, Slot]
    slopes: dict[str, Slot]  # of its continuous states
    record: Record
    position: int
    output: Call | None = None
    update: Call | None = None
    deriv: Call | None = None

    def field(self, name: str) -> Slot:
        """Return the slot of a parameter or state."""
        item = self.record[name]
        return Slot(item.scalar, item.shape, self.position + item.offset)

    @property
    def row(self) -> slice:
        """The bytes of its outputs that are numbers, side by side."""
        slots = [slot for slot in self.outputs.values() if slot.scalar != "frame"]
        if not slots:
            return slice(0, 0)
        return slice(slots[0].position * SLOT, (slots[-1].position + slots[-1].size) * SLOT)


@dataclass(eq=False)
class Plan:
    """The layout and the calls of one graph. ``steps`` are the blocks in execution order."""

    graph: Graph
    memory: Memory
    steps: list[Bound]
    held: slice  # the bytes of the time and of the continuous task's signals, which minor steps write over
    delays: dict[str, list[Call]] = field(default_factory=dict)  # task -> copies made before its blocks run
    continuous: Positions = field(default_factory=lambda: _positions(()))  # of the continuous states
    slopes: Positions = field(
        default_factory=lambda: _positions(())
    )  # of their derivatives, in the same order
    derivatives: list[Call] = field(default_factory=list)
    minor: list[Call] = field(default_factory=list)  # the outputs that derivatives depend on

    def __post_init__(self) -> None:
        self._by_path = {step.node.path: step for step in self.steps}

    def __getitem__(self, path: str) -> Bound:
        return self._by_path[path]

    def owner(self, call: Call) -> Bound:
        """Return the block that a call belongs to."""
        return next(step for step in self.steps if call in (step.output, step.update, step.deriv))

    def finite(self, steps: Sequence[Bound]) -> Positions:
        """Return the positions that must hold finite numbers once these blocks have run."""
        return _positions(
            slot
            for step in steps
            for name, slot in step.outputs.items()
            if slot.scalar == "float64" and not step.node.block.interface.outputs[name].nan
        )


def _positions(slots: Iterable[Slot]) -> Positions:
    """Return the position of every element."""
    ranges = [range(slot.position, slot.position + slot.size) for slot in slots]
    return np.array([position for run in ranges for position in run], np.intp)


def make_plan(graph: Graph, seed: int) -> Plan:
    """Lay out memory, bind every block and prepare its calls; states hold their initial values, seeded."""
    layout = _Layout(graph)
    memory = Memory(layout.size, [NO_FRAME] * layout.frames)
    steps = [_bind(memory, layout, node, seed) for node in graph.nodes]
    plan = Plan(graph, memory, steps, slice(0, layout.continuous * SLOT))
    for (path, port), slot in layout.delayed.items():
        task = graph[path].task.name
        plan.delays.setdefault(task, []).append(memory.copy(layout.outputs[path][port], slot))
    _prepare_continuous(plan)
    return plan


def _bind(memory: Memory, layout: _Layout, node: Node, seed: int) -> Bound:
    record, position = layout.records[node.path]
    bound_self = memory.bind(node.block, record, position, float(node.task.period))
    inputs = {port: layout.source(node, port) for port in node.inputs}
    slopes = layout.slopes[node.path]
    bound = Bound(node, bound_self, inputs, layout.outputs[node.path], slopes, record, position)
    for port, source in node.inputs.items():
        if isinstance(source, Constant):
            memory.write(inputs[port], source.value)
    for name, state in node.block.interface.states.items():
        if isinstance(state, Random):
            memory.write(bound.field(name), _stream(seed, node.path, name))
    if "output" in node.block.interface.arguments:
        bound.output = _call(memory, bound, "output", list(bound.outputs.values()))
    if "update" in node.block.interface.arguments:
        bound.update = _call(memory, bound, "update", [])
    if "deriv" in node.block.interface.arguments:
        bound.deriv = _call(memory, bound, "deriv", list(slopes.values()))
    return bound


def _call(memory: Memory, bound: Bound, method: str, targets: list[Slot]) -> Call:
    names = bound.node.block.interface.arguments[method]
    arguments = [TIME if name == "time" else bound.inputs[name] for name in names]
    return memory.call(getattr(bound.self, method), arguments, targets)


def _prepare_continuous(plan: Plan) -> None:
    """Gather the continuous states, and find the blocks that minor steps must compute again."""
    states = [(step.field(name), slope) for step in plan.steps for name, slope in step.slopes.items()]
    plan.continuous = _positions(state for state, _ in states)
    plan.slopes = _positions(slope for _, slope in states)
    plan.derivatives = [step.deriv for step in plan.steps if step.deriv is not None]
    needed: set[str] = set()
    for step in plan.steps:
        needed.update(_sources(step.node, step.node.block.interface.arguments.get("deriv", ())))
    moving = _moving(plan.steps)
    for step in reversed(plan.steps):
        node = step.node
        if node.path in needed & moving and step.output is not None:
            plan.minor.insert(0, step.output)
            needed.update(_sources(node, node.block.interface.feedthrough))


def _moving(steps: Sequence[Bound]) -> set[str]:
    """Return the blocks whose outputs move between two ticks.

    They are in the continuous task, and have continuous states, or follow time or another moving block. A
    block that has an ``update`` and passes its input on is a sampled one: its output stands still until the
    next tick. So does that of a block which is not numeric, since it may reach outside.
    """
    found: set[str] = set()
    for step in steps:
        node, interface = step.node, step.node.block.interface
        if not node.task.continuous:
            continue
        follows = "time" in interface.arguments.get("output", ())
        if "update" not in interface.arguments:
            follows |= not found.isdisjoint(_sources(node, interface.feedthrough))
        if interface.continuous or (node.block.numeric and follows):
            found.add(node.path)
    return found


def _sources(node: Node, ports: Iterable[str]) -> Iterator[str]:
    """Yield the blocks whose present outputs some inputs of a block read."""
    return (wire.block for _, wire in node.wires(ports) if wire.crossing != "delay")


def _stream(seed: int, path: str, state: str) -> list[int]:
    """Return the start of a random stream: a hash, so that streams do not depend on other blocks."""
    digest = hashlib.sha256(f"{seed}/{path}.{state}".encode()).digest()
    return [1 + int.from_bytes(digest[4 * i : 4 * i + 4], "little") % (STREAM_MODULUS - 1) for i in range(6)]


class _Layout:
    """Gives every signal, constant, delayed value and record its place."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.size, self.frames = 1, 0
        self.constants: dict[tuple[str, str], Slot] = {}
        self.outputs: dict[str, dict[str, Slot]] = {}
        self.delayed: dict[tuple[str, str], Slot] = {}
        self.slopes: dict[str, dict[str, Slot]] = {}
        self.records: dict[str, tuple[Record, int]] = {}
        self.continuous = 1  # where the continuous task's signals end
        for task in graph.tasks:
            for node in graph.nodes:
                if node.task == task:
                    ports = node.block.interface.outputs
                    self.outputs[node.path] = {port: self._take(node, port) for port in ports}
            if task.continuous:
                self.continuous = self.size
        for node in graph.nodes:
            for port, source in node.inputs.items():
                if isinstance(source, Constant):
                    self.constants[node.path, port] = self._take(node, port)
        for node in graph.nodes:
            for _, wire in node.wires():
                key = (wire.block, wire.port)
                if wire.crossing == "delay" and key not in self.delayed:
                    self.delayed[key] = self._take(graph[wire.block], wire.port)
        for node in graph.nodes:
            self.slopes[node.path] = {
                state.name: self._room("float64", node.shape(state.name))
                for state in node.block.interface.continuous
            }
        for node in graph.nodes:
            record = Record.of(node.block, node.sizes)
            self.records[node.path] = (record, self.size)
            self.size += record.size

    def _take(self, node: Node, port: str) -> Slot:
        interface = node.block.interface
        scalar = (interface.inputs.get(port) or interface.outputs[port]).signal.scalar
        if scalar == "frame":
            self.frames += 1
            return Slot("frame", (), self.frames - 1)
        return self._room(scalar, node.shape(port))

    def _room(self, scalar: str, shape: Shape) -> Slot:
        slot = Slot(scalar, shape, self.size)
        self.size += slot.size
        return slot

    def source(self, node: Node, port: str) -> Slot:
        """Return the slot that an input reads."""
        source: Any = node.inputs[port]
        if isinstance(source, Constant):
            return self.constants[node.path, port]
        wire: Wire = source
        delayed = wire.crossing == "delay"
        slot = self.delayed[wire.block, wire.port] if delayed else self.outputs[wire.block][wire.port]
        if not wire.index:
            return slot
        part = selected(slot.shape, wire.index)
        assert part is not None, "the checker refuses parts that are not in one piece"
        return Slot(slot.scalar, part[1], slot.position + part[0])
