"""What is exported: blocks of a checked diagram, with what comes in from outside and what goes out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from quadvis.block import Block, Out, State
from quadvis.diagram.diagram import Diagram
from quadvis.errors import QuadvisError, sentence, suggestion
from quadvis.fmi.signals import plain_name
from quadvis.graph.graph import MULTI, VARIABLE, Graph, Node, Wire
from quadvis.graph.names import read_name

WHOLE = "."  # names the whole diagram
INPUT = "fmu input"  # the kind of the blocks in the place of what comes from outside
HELD = "held"  # their state: the value that was set
CONDITIONAL = ("when", "trigger", "reset")  # the inputs of a condition that come from the diagram


@dataclass(frozen=True)
class ExportPort:
    """An input or an output: elements of a port or of a state of a block, as a signal of its own."""

    name: str
    block: str
    port: str
    elements: tuple[int, ...]
    shape: tuple[int, ...]
    unit: str
    scalar: str


@dataclass(frozen=True)
class ExportSelection:
    """Blocks of a diagram as a graph of their own, which has a block for each signal from outside."""

    name: str
    graph: Graph
    inputs: tuple[ExportPort, ...]
    outputs: tuple[ExportPort, ...]


def selected_blocks(diagram: Diagram, name: str) -> ExportSelection:
    """Return what a name means: a part, a block, or "." for the whole diagram.

    QuadvisError, in a sentence, if there is no such part, or if it has blocks that no FMU can have.
    """
    graph = diagram.graph
    chosen = [node for node in graph.nodes if _belongs(node.path, name)]
    if not chosen:
        names = {node.path.split("/")[0] for node in graph.nodes} | {node.path for node in graph.nodes}
        raise QuadvisError(
            sentence(f"there is no part and no block '{name}'", suggestion(name, sorted(names)))
        )
    if graph.tasking == MULTI:
        raise QuadvisError("a diagram with 'tasking: multi' cannot be exported; leave the key out")
    if graph.solver in VARIABLE and any(node.block.interface.continuous for node in chosen):
        problem = f"the solver '{graph.solver}' cannot be exported"
        raise QuadvisError(sentence(problem, "choose one of fixed step, ode1 to ode4"))
    _refuse(chosen)
    inputs = _Inputs(diagram, name, chosen)
    nodes = [*inputs.nodes.values(), *(replace(node, inputs=inputs.wired(node)) for node in chosen)]
    step = graph.step if any(node.task.continuous for node in nodes) else None
    made = Graph(graph.name, nodes, graph.solver, step, graph.tasking)
    return ExportSelection(name, made, tuple(inputs.terminals), tuple(_outputs(diagram, name, chosen)))


def _belongs(path: str, name: str) -> bool:
    return name == WHOLE or path == name or path.startswith(f"{name}/")


def _refuse(chosen: Sequence[Node]) -> None:
    """Refuse blocks that are no arithmetic, and those whose condition is not chosen with them."""
    unfit = [node for node in chosen if not node.block.numeric]
    if unfit:
        named = ", ".join(f"'{node.path}' ({node.kind})" for node in unfit[:3])
        more = f" and {len(unfit) - 3} more" if len(unfit) > 3 else ""
        problem = f"only numeric blocks can be exported, and these are not: {named}{more}"
        raise QuadvisError(sentence(problem, "export a part without them"))
    inside = {node.path for node in chosen}
    for node in chosen:
        if node.condition and node.condition not in inside:
            owner = node.condition.rpartition("/")[0] or WHOLE
            problem = (
                f"'{node.path}' does not always run: its condition '{node.condition}' lies outside of it"
            )
            raise QuadvisError(sentence(problem, f"export '{owner}'"))


def _gives(self: Any) -> Any:
    return self.held


class _Inputs:
    """Blocks in the place of the producers outside, and the inputs that they are for an importer."""

    def __init__(self, diagram: Diagram, name: str, chosen: Sequence[Node]) -> None:
        self._diagram, self._chosen = diagram, chosen
        self._inside = {node.path for node in chosen}
        self._conditions = dict.fromkeys(node.condition for node in chosen if node.condition)
        self._read: dict[tuple[str, str], list[tuple[Node, Wire]]] = {}
        for node in chosen:
            for _, wire in node.wires():
                if wire.block not in self._inside:
                    self._read.setdefault((wire.block, wire.port), []).append((node, wire))
        self._names = {pair: f"{INPUT}/{pair[0].replace('/', '_')}_{pair[1]}" for pair in self._read}
        self.nodes = {pair: self._node(pair, readers) for pair, readers in self._read.items()}
        self.terminals = list(self._terminals(name))

    def wired(self, node: Node) -> dict[str, Any]:
        """Return the inputs of a block, with the blocks here in the place of those outside."""
        return {
            port: replace(source, block=self._names[source.block, source.port], port="y")
            if isinstance(source, Wire) and (source.block, source.port) in self._names
            else source
            for port, source in node.inputs.items()
        }

    def _node(self, pair: tuple[str, str], readers: Sequence[tuple[Node, Wire]]) -> Node:
        """Return the block that stands for a port outside.

        It runs with its fastest reader; what is read late keeps the period of its producer.
        """
        producer = self._diagram.graph[pair[0]]
        declared = producer.block.interface.outputs[pair[1]]
        if declared.signal.scalar == "frame":
            raise QuadvisError(
                f"'{pair[0]}.{pair[1]}' is a picture, which no FMU takes; export a part without it"
            )
        tasks = [node.task for node, _ in readers]
        late = any(wire.delayed for _, wire in readers)
        task = producer.task if late else min(tasks, key=lambda each: (each.period, each.offset))
        shape, scalar = producer.shape(pair[1]), declared.signal.scalar
        kind = scalar + (f"[{','.join(map(str, shape))}]" if shape else "")
        members = {
            "y": Out(kind, doc="what was set", nan=getattr(declared, "nan", False)),
            HELD: State(kind, doc="what was set"),
            "output": _gives,
            "__doc__": "An input from outside.",
        }
        block: Block = type("FmuInput", (Block,), members)(period=float(task.period))
        return Node(self._names[pair], INPUT, block, task, {}, units={"y": producer.units[pair[1]]})

    def _terminals(self, name: str) -> Iterator[ExportPort]:
        """Yield the inputs: first those that are ports of the part, then what else comes in."""
        taken = set[str]()
        covered: dict[tuple[str, str], set[int]] = {pair: set() for pair in self._read}
        for port, wire in self._entries(name):
            pair = wire.block, wire.port
            if pair not in self._read:
                continue
            numbers = _numbers(self._diagram.graph[wire.block], wire)
            if covered[pair] & {*numbers.ravel().tolist()}:
                continue  # the diagram feeds two ports from one signal
            covered[pair] |= {*numbers.ravel().tolist()}
            taken.add(port)
            yield self._terminal(port, pair, numbers)
        for pair, readers in self._read.items():
            used = {
                int(k) for _, wire in readers for k in _numbers(self._diagram.graph[pair[0]], wire).ravel()
            }
            rest = sorted(used - covered[pair])
            if not rest:
                continue
            whole = np.arange(self._size(pair)).reshape(self._diagram.graph[pair[0]].shape(pair[1]))
            numbers = whole if len(rest) == whole.size else np.array(rest)
            label = plain_name(f"{pair[0]}_{pair[1]}", taken)
            taken.add(label)
            yield self._terminal(label, pair, numbers)

    def _entries(self, name: str) -> Iterator[tuple[str, Wire]]:
        """Yield the inputs of the part, or of the block, with what feeds them; ``u[0]`` is ``u_0``.

        What says when it runs is an input, too: ``when``, ``trigger`` and ``reset``.
        """
        found: dict[str, Wire] = {}
        if name in self._inside:
            found |= {plain_name(port, ()): wire for port, wire in self._diagram.graph[name].wires()}
        for label, text in self._diagram.entries.items():
            part, _, port = label.rpartition(".")
            wire = read_name(text)
            if part == name and wire is not None:
                found[port] = wire
        for path in self._conditions:
            if path.rpartition("/")[0] == name:
                found = dict(self._diagram.graph[path].wires()) | found
        yield from sorted(found.items(), key=lambda pair: pair[0] in CONDITIONAL)

    def _size(self, pair: tuple[str, str]) -> int:
        return int(np.prod(self._diagram.graph[pair[0]].shape(pair[1]), dtype=int))

    def _terminal(self, label: str, pair: tuple[str, str], numbers: Any) -> ExportPort:
        producer = self._diagram.graph[pair[0]]
        scalar = producer.block.interface.outputs[pair[1]].signal.scalar
        elements = tuple(int(k) for k in numbers.ravel())
        unit = _unit(producer, pair[1], elements)
        return ExportPort(label, self._names[pair], HELD, elements, tuple(numbers.shape), unit, scalar)


def _numbers(node: Node, wire: Wire) -> Any:
    """Return the elements that a wire takes, by their flat numbers, in its shape."""
    shape = node.shape(wire.port)
    return np.arange(int(np.prod(shape, dtype=int))).reshape(shape)[wire.index]


def _unit(node: Node, port: str, elements: Sequence[int]) -> str:
    units = node.units.get(port)
    names = {str(units[k]) for k in elements} if units else set()
    return names.pop() if len(names) == 1 else ""


def _outputs(diagram: Diagram, name: str, chosen: Sequence[Node]) -> Iterator[ExportPort]:
    inside = {node.path: node for node in chosen}
    for label, wire in _exports(diagram, name, inside):
        node = inside[wire.block]
        declared = node.block.interface.outputs[wire.port]
        if declared.signal.scalar == "frame":
            continue
        numbers = _numbers(node, wire)
        elements = tuple(int(k) for k in numbers.ravel())
        yield ExportPort(
            label, wire.block, wire.port, elements, tuple(numbers.shape), _unit(node, wire.port, elements),
            declared.signal.scalar,
        )  # fmt: skip


def _exports(diagram: Diagram, name: str, inside: Mapping[str, Node]) -> Iterator[tuple[str, Wire]]:
    """Yield the outputs by name: the ports of a part, those of a block, or of the whole what it logs."""
    if name in inside:
        for port in inside[name].block.interface.outputs:
            yield port, read_name(diagram.ports.get(f"{name}.{port}", "")) or Wire(name, port)
    elif name != WHOLE:
        for label, text in diagram.ports.items():
            part, _, port = label.rpartition(".")
            wire = read_name(text)
            if part == name and wire is not None and wire.block in inside:
                yield port, wire
    else:
        for path, node in inside.items():
            if diagram.logs(path):
                yield from (
                    (f"{path.replace('/', '.')}.{port}", Wire(path, port))
                    for port in node.block.interface.outputs
                )
