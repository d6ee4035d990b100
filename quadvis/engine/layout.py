"""Where everything lies: every signal, constant, delayed value and block in one run of 8-byte slots.

In slots: time | signals, task by task (the continuous one first), block by block | times of tasks that run
by themselves | constants | delayed signals | slopes | one record per block. A block's outputs lie side by
side: a row of the log is one slice.
Frames lie in a list beside it, and so do frames that a block keeps as states.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from quadvis.block import Block, Shape
from quadvis.engine.memory import SLOT, Record, Slot
from quadvis.graph.graph import DELAY, MULTI, Constant, Graph, Node, Task, Wire, selected

TIME = Slot("float64", (), 0)
NO_BLOCK = -1


class Slots(Mapping[str, Slot]):
    """Slots by name, in order. It never changes, so that whatever holds it can be hashed."""

    def __init__(self, items: Mapping[str, Slot]) -> None:
        self._items = dict(items)

    def __getitem__(self, name: str) -> Slot:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __or__(self, other: Mapping[str, Slot]) -> dict[str, Slot]:
        return self._items | dict(other)

    def __hash__(self) -> int:
        return hash(tuple(self._items.items()))

    def __repr__(self) -> str:
        return repr(self._items)


@dataclass(frozen=True)
class Placed:
    """One block of a program: its kind, its task, and the slots of its ports, slopes, and record.

    ``condition`` is the number of the block that says when it runs, `NO_BLOCK` if it always does.
    ``record`` begins at ``position``; ``frames`` are the places of the states that hold frames; ``nan`` are
    the outputs in which NaN says "missing".
    """

    path: str
    kind: str
    task: str
    inputs: Slots
    outputs: Slots
    slopes: Slots  # derivatives of its continuous states
    frames: Slots
    record: Record
    position: int
    nan: tuple[str, ...] = ()
    condition: int = NO_BLOCK

    def field(self, name: str) -> Slot:
        """Return the slot of a parameter, a state or Work; KeyError if none has this name."""
        if name in self.frames:
            return self.frames[name]
        item = self.record[name]
        return Slot(item.scalar, item.shape, self.position + item.offset)

    @cached_property
    def row(self) -> slice:
        """The bytes of its outputs that are numbers, side by side."""
        slots = [slot for slot in self.outputs.values() if slot.scalar != "frame"]
        if not slots:
            return slice(0, 0)
        return slice(slots[0].position * SLOT, (slots[-1].position + slots[-1].size) * SLOT)


class Layout:
    """Gives every block of a graph its places, in the order of execution: ``blocks``.

    ``times`` are the slots of time of those tasks that do not have `TIME`.
    ``delays`` and ``latches`` are copies from slot to slot between an output and its readers, by the task at
    whose ticks they are made: the producer's for a delay, the reader's for a latch. Of an output there are
    several copies if some belong to the states under a condition: ``kept`` has these, by the condition.
    """

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self.size, self.frames = 1, 0
        self._records: dict[Hashable, Record] = {}
        self.continuous = self.size  # the slot at which the continuous task's signals end
        self._outputs = self._signals()
        # With tasks that run each by itself, all but the fastest have a time of their own.
        own = graph.tasks[1:] if graph.tasking == MULTI else ()
        self.times = {task.name: self._room("float64", ()) for task in own}
        self._constants = {
            (node.path, port): self._take(node, port)
            for node in graph.nodes
            for port, source in node.inputs.items()
            if isinstance(source, Constant)
        }
        self._numbers = {node.path: number for number, node in enumerate(graph.nodes)}
        self._copied: dict[tuple[str, Slot, str], Slot] = {}
        self.delays: dict[str, list[tuple[Slot, Slot]]] = {}
        self.latches: dict[str, list[tuple[Slot, Slot]]] = {}
        self.kept: dict[str, list[Slot]] = {}
        for node in graph.nodes:
            for _, wire in node.wires():
                self._whole(node, wire)
        slopes = {node.path: self._slopes(node) for node in graph.nodes}
        self.blocks = tuple(self._place(node, slopes[node.path]) for node in graph.nodes)

    def _whole(self, node: Node, wire: Wire) -> Slot:
        """Return the slot from which a wire reads: an output, or a copy of it, for which room is made."""
        slot = self._outputs[wire.block][wire.port]
        if not (wire.delayed or wire.latched):
            return slot
        producer, inside = self._graph[wire.block], self._inside(node, wire)
        for copied, copies, task in (
            (wire.delayed, self.delays, producer.task),
            (wire.latched, self.latches, node.task),
        ):
            if not copied:
                continue
            key = task.name, slot, inside
            if key not in self._copied:
                self._copied[key] = made = self._take(producer, wire.port)
                copies.setdefault(task.name, []).append((slot, made))
                if inside:
                    self.kept.setdefault(inside, []).append(made)
            slot = self._copied[key]
        return slot

    def _inside(self, node: Node, wire: Wire) -> str:
        """Return the innermost condition of the producer under which the reader runs, too; "" if none is.

        The conditions of one part at several rates stand side by side in it. What another thread reads does
        not belong to the states of this one.
        """
        apart = self._graph.tasking == MULTI and node.task != self._graph[wire.block].task
        if apart or wire.crossing != DELAY:
            return ""
        around = set(self._graph.around(node.path))
        for path in self._graph.around(wire.block):
            folder = path.rpartition("/")[0]
            if path in around or (folder and node.path.startswith(f"{folder}/")):
                return path
        return ""

    def _signals(self) -> dict[str, Slots]:
        found = {}
        nodes: dict[Task, list[Node]] = {task: [] for task in self._graph.tasks}
        for node in self._graph.nodes:
            nodes[node.task].append(node)
        for task, mine in nodes.items():
            for node in mine:
                ports = node.block.interface.outputs
                found[node.path] = Slots({port: self._take(node, port) for port in ports})
            if task.continuous:
                self.continuous = self.size
        return found

    def _slopes(self, node: Node) -> Slots:
        states = node.block.interface.continuous
        return Slots({state.name: self._room("float64", node.shape(state.name)) for state in states})

    def _place(self, node: Node, slopes: Slots) -> Placed:
        record, position = self._record(node), self.size
        self.size += record.size
        ports = node.block.interface.outputs
        return Placed(
            node.path,
            node.kind,
            node.task.name,
            Slots({port: self._source(node, port) for port in node.inputs}),
            self._outputs[node.path],
            slopes,
            self._frames(node.block),
            record,
            position,
            tuple(port for port in ports if ports[port].nan),
            self._numbers.get(node.condition, NO_BLOCK),
        )

    def _record(self, node: Node) -> Record:
        """Return the record of a block, which those of one class and with equal sizes share."""
        kind = type(node.block), tuple(node.sizes.items())
        if kind not in self._records:
            self._records[kind] = Record.of(node.block, node.sizes)
        return self._records[kind]

    def _frames(self, block: Block) -> Slots:
        places = {}
        for name, state in block.interface.states.items():
            if state.signal.scalar == "frame":
                places[name] = Slot("frame", state.signal.resolve({}), self.frames)
                self.frames += places[name].size
        return Slots(places)

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

    def _source(self, node: Node, port: str) -> Slot:
        """Return the slot that an input reads."""
        source = node.inputs[port]
        if not isinstance(source, Wire):
            return self._constants[node.path, port]
        slot = self._whole(node, source)
        if source.index:
            part = selected(slot.shape, source.index)
            assert part is not None, "the checker refuses parts that are not in one piece"
            slot = Slot(slot.scalar, part[1], slot.position + part[0])
        # An input that takes a scalar as an array of one element, [n?], reads the same slot as such.
        return slot if slot.shape or slot.scalar == "frame" else slot._replace(shape=node.shape(port))
