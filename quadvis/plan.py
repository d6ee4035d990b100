"""From a checked graph to something that runs: one memory layout and flat lists of calls.

Layout, in 8-byte slots: time | constants | signals, task by task and block by block | delayed signals | slopes | one record per block. A block's
outputs lie side by side, so a row of the log is one slice. The native tier is meant to run the same plan.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block import NO_FRAME, Block, Random
from quadvis.graph import Constant, Graph, Node, Task, Wire, selected
from quadvis.memory import Memory, Record, Slot

Call = Callable[[], None]
TIME = Slot("float64", (), 0)
STREAM_MODULUS = 4294944443  # the smaller of the two moduli of MRG32k3a: every seed below it is valid


@dataclass(eq=False)
class Bound:
    """A block in its place: ``self`` over memory, its input and output slots, its calls."""

    node: Node
    self: Block
    inputs: dict[str, Slot]
    outputs: dict[str, Slot]
    record: Record
    position: int
    output: Call | None = None
    update: Call | None = None

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
        return slice(slots[0].position * 8, (slots[-1].position + slots[-1].size) * 8)


@dataclass(eq=False)
class Plan:
    """The layout and the calls of one graph. ``steps`` are the blocks in execution order."""

    graph: Graph
    memory: Memory
    steps: list[Bound]
    delays: dict[str, list[Call]] = field(default_factory=dict)  # task -> copies made before its blocks run
    continuous: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))  # places of the states
    slopes: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))  # their derivatives, in the same order
    derivatives: list[Call] = field(default_factory=list)
    minor: list[Call] = field(default_factory=list)  # the outputs that derivatives depend on

    def __getitem__(self, path: str) -> Bound:
        return next(step for step in self.steps if step.node.path == path)

    def due(self, tasks: Sequence[Task]) -> list[Bound]:
        """Return the blocks of some tasks in execution order: what runs at a tick at which these are due."""
        return [step for step in self.steps if step.node.task in tasks]

    def finite(self, steps: Sequence[Bound]) -> NDArray[np.intp]:
        """Return the positions that must hold finite numbers once these blocks have run."""
        positions: list[int] = []
        for step in steps:
            for name, slot in step.outputs.items():
                if slot.scalar == "float64" and not step.node.block.interface.outputs[name].nan:
                    positions.extend(range(slot.position, slot.position + slot.size))
        return np.array(positions, np.intp)


def make_plan(graph: Graph, seed: int) -> Plan:
    """Lay out memory, bind every block and prepare its calls; states hold their initial values, seeded."""
    layout = _Layout(graph)
    memory = Memory(layout.size, [NO_FRAME] * layout.frames)
    plan = Plan(graph, memory, [])
    for node in graph.nodes:
        record, position = layout.records[node.path]
        bound_self = memory.bind(node.block, record, position, float(node.task.period))
        inputs = {port: layout.source(node, port) for port in node.inputs}
        bound = Bound(node, bound_self, inputs, layout.outputs[node.path], record, position)
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
        plan.steps.append(bound)
    for (path, port), slot in layout.delayed.items():
        task = graph[path].task.name
        plan.delays.setdefault(task, []).append(memory.copy(layout.outputs[path][port], slot))
    _prepare_continuous(plan, layout.slopes)
    return plan


def _call(memory: Memory, bound: Bound, method: str, targets: list[Slot]) -> Call:
    names = bound.node.block.interface.arguments[method]
    arguments = [TIME if name == "time" else bound.inputs[name] for name in names]
    return memory.call(getattr(bound.self, method), arguments, targets)


def _prepare_continuous(plan: Plan, slopes: int) -> None:
    """Number the continuous states, and find the blocks that minor steps must compute again."""
    positions: list[int] = []
    needed: set[str] = set()
    for step in plan.steps:
        node, interface = step.node, step.node.block.interface
        targets = []
        for state in interface.continuous:
            slot = step.field(state.name)
            targets.append(Slot("float64", slot.shape, slopes + len(positions)))
            positions.extend(range(slot.position, slot.position + slot.size))
        if targets:
            plan.derivatives.append(_call(plan.memory, step, "deriv", targets))
            needed.update(wire.block for _, wire in node.wires(interface.arguments["deriv"]))
    plan.continuous = np.array(positions, np.intp)
    plan.slopes = plan.memory.floats[slopes : slopes + len(positions)]
    for step in reversed(plan.steps):
        node = step.node
        if node.path in needed and node.task.continuous and step.output is not None:
            plan.minor.insert(0, step.output)
            needed.update(wire.block for _, wire in node.wires(node.block.interface.feedthrough))


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
        self.records: dict[str, tuple[Record, int]] = {}
        for node in graph.nodes:
            for port, source in node.inputs.items():
                if isinstance(source, Constant):
                    self.constants[node.path, port] = self._take(node, port)
        for task in graph.tasks:
            for node in graph.nodes:
                if node.task == task:
                    self.outputs[node.path] = {port: self._take(node, port) for port in node.block.interface.outputs}
        for node in graph.nodes:
            for _, wire in node.wires():
                key = (wire.block, wire.port)
                if wire.crossing == "delay" and key not in self.delayed:
                    self.delayed[key] = self._take(graph[wire.block], wire.port)
        self.slopes = self.size
        self.size += sum(
            math.prod(node.shape(state.name)) for node in graph.nodes for state in node.block.interface.continuous
        )
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
        slot = Slot(scalar, node.shape(port), self.size)
        self.size += math.prod(slot.shape)
        return slot

    def source(self, node: Node, port: str) -> Slot:
        """Return the slot that an input reads."""
        source: Any = node.inputs[port]
        if isinstance(source, Constant):
            return self.constants[node.path, port]
        wire: Wire = source
        slot = self.delayed[wire.block, wire.port] if wire.crossing == "delay" else self.outputs[wire.block][wire.port]
        if not wire.index:
            return slot
        part = selected(slot.shape, wire.index)
        assert part is not None, "the checker refuses parts that are not in one piece"
        return Slot(slot.scalar, part[1], slot.position + part[0])
