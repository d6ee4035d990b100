"""The flow of shapes and units along wires before a run, from declarations and given values."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from quadvis.block import Block, In, Interface
from quadvis.diagram.values import OpenUnits, shape_text
from quadvis.errors import UNKNOWN, Faults, Place, Unknown
from quadvis.graph.graph import Constant, Node, Task, Wire, selected
from quadvis.graph.names import index_text
from quadvis.units import Unit

ONE = Unit()
Key = tuple[str, str]  # block and input


@dataclass
class Connection:
    """One input as the diagram gives it, with the place to name in a fault."""

    place: Place
    source: Wire | Constant | Unknown
    units: OpenUnits = ()  # of a constant, where the declaration leaves them open
    across: Place | Unknown | None = None  # where the crossing is written


@dataclass
class Draft:
    """A block whose wires are not checked yet."""

    path: str
    place: Place
    kind: str
    type: type[Block]
    block: Block | Unknown
    task: Task | Unknown
    connections: dict[str, Connection]
    places: Mapping[str, Place] = field(default_factory=dict)  # of the parameters that are given
    units: Mapping[str, OpenUnits] = field(default_factory=dict)  # of the parameters where they are open
    origins: Mapping[str, Place] = field(default_factory=dict)  # where their values are written

    @property
    def interface(self) -> Interface:
        """The declarations of the block, which are known even if its parameters are not."""
        return self.type.interface


class Link(NamedTuple):
    """A wire whose two ports exist."""

    draft: Draft
    port: str
    connection: Connection
    wire: Wire
    declared: In

    @property
    def key(self) -> Key:
        """Its identity: block and input."""
        return self.draft.path, self.port


class Flow:
    """Lets known facts flow along the wires until all is known, each block after the blocks that feed it.

    ``unknown`` are inputs without any known fact: blocks that depend on them are left out. A cycle has no
    first block: there one block goes ahead with what it has. What is found does not depend on the order of
    the blocks in the file: where a choice is left the names decide.
    """

    def __init__(self, drafts: Mapping[str, Draft], nodes: Mapping[str, Node], links: Sequence[Link],
                 unknown: Collection[Key], faults: Faults) -> None:  # fmt: skip
        self.drafts, self.nodes, self.faults = drafts, nodes, faults
        self.unknown = set(unknown)
        self._waiting = {link.key: link for link in links}
        self._ready: dict[Key, Link] = {}  # those that wait only for the other inputs of their block
        self._settled: set[str] = set()
        self._reported: set[Place] = set()
        self._into: dict[str, list[Link]] = {path: [] for path in drafts}
        self._from: dict[str, list[Link]] = {path: [] for path in drafts}
        for link in sorted(links, key=self._order):
            self._into[link.draft.path].append(link)
            self._from[link.wire.block].append(link)

    @staticmethod
    def _order(link: Link) -> tuple[str, int]:
        """Return a key that sorts wires by the block and the port that they feed."""
        return link.draft.path, list(link.draft.interface.inputs).index(link.port)

    def run(self) -> None:
        """Follow every wire."""
        for path in sorted(self.drafts):
            if not self._pending(path) and path not in self._settled:
                self._settle(path)
        while self._waiting:
            if self._ready:
                link = min(self._ready.values(), key=self._order)
                self._take(link)
                self._spread(link.draft.path)
                continue
            path = max(sorted(self._first_ring()), key=self.knowledge)
            if self.prepare(path):
                self._spread(path)
            else:
                self._settle(path)

    def _pending(self, path: str) -> list[Link]:
        return [link for link in self._into[path] if link.key in self._waiting]

    def _first_ring(self) -> list[str]:
        """Return blocks that wait for each other and for no others.

        They are the first strongly connected component that Tarjan's search closes on its way against the
        signals.
        """
        number: dict[str, int] = {}
        lowest: dict[str, int] = {}
        trail: list[tuple[str, Iterator[Link]]] = []

        def enter(path: str) -> None:
            number[path] = lowest[path] = len(number)
            trail.append((path, iter(self._pending(path))))

        enter(min(link.wire.block for link in self._waiting.values()))
        while True:
            path, links = trail[-1]
            link = next(links, None)
            if link is not None and link.wire.block not in number:
                enter(link.wire.block)
            elif link is not None:
                lowest[path] = min(lowest[path], number[link.wire.block])
            elif lowest[path] == number[path]:
                return [member for member, count in number.items() if count >= number[path]]
            else:
                trail.pop()
                before = trail[-1][0]
                lowest[before] = min(lowest[before], lowest[path])

    def _settle(self, path: str) -> None:
        self._settled.add(path)
        self.settle(path)
        self._spread(path)

    def _spread(self, path: str) -> None:
        """Pass the known facts of a block to its readers, and from them to their readers."""
        changed = [path]
        while changed:
            path = changed.pop()
            for link in self._from[path]:
                if link.key in self._waiting and (self.knows(link) or path in self._settled):
                    self._ready[link.key] = link
                    pending = self._pending(link.draft.path)
                    if all(each.key in self._ready for each in pending):
                        # In the order of the ports, so that of two that disagree the second is wrong.
                        for each in pending:
                            self._take(each)
                        if link.draft.path not in self._settled:
                            self._settled.add(link.draft.path)
                            self.settle(link.draft.path)
                        changed.append(link.draft.path)

    def _take(self, link: Link) -> None:
        del self._waiting[link.key]
        del self._ready[link.key]
        if not self.knows(link) or not self.take(link):
            self.unknown.add(link.key)

    def fault(self, path: str, place: Place, problem: str, remedy: str = "") -> None:
        """Report a fault of a block, once for a wire that leads to several blocks of a part."""
        if place not in self._reported:
            self._reported.add(place)
            self.faults.add(place, problem, remedy, subject=f"block '{path}'")

    def knows(self, link: Link) -> bool:
        """Return whether the fact that a wire carries is known."""
        raise NotImplementedError

    def take(self, link: Link) -> bool:
        """Give it to the consumer; False if it does not fit, which is reported."""
        raise NotImplementedError

    def settle(self, path: str) -> None:
        """Decide the open facts of a block, because no more will become known."""
        raise NotImplementedError

    def prepare(self, path: str) -> bool:
        """Let a block in a cycle use its certain facts, before anything is decided; False if it has none."""
        return False

    def knowledge(self, path: str) -> int:
        """Return how well a block can go ahead in a ring; higher is better."""
        return 0


def misfit(wire: Wire, shape: Sequence[int]) -> str:
    """Say that an index goes beyond a signal."""
    return f"index {index_text(wire.index)} does not fit '{wire.source}', which has {shape_text(shape)}"


def unconnected(port: str, declared: In) -> tuple[str, str]:
    """Return the problem and the remedy of an input that nothing feeds."""
    constant = ", or a constant" if declared.signal.scalar != "frame" else ""
    return f"input '{port}' is not connected", f"add '{port}: block.port' under 'in'{constant}"


class ShapeFlow(Flow):
    """Shapes: fixes the symbolic sizes of every node."""

    def knows(self, link: Link) -> bool:
        """Say whether the producer's sizes are fixed."""
        node = self.nodes[link.wire.block]
        shape = node.block.interface.outputs[link.wire.port].signal.shape
        return all(size in node.sizes for size in shape if isinstance(size, str))

    def take(self, link: Link) -> bool:
        """Match the part that the index takes."""
        wire = link.wire
        shape = self.nodes[wire.block].shape(wire.port)
        source = f"'{wire.source}' has {shape_text(shape)}"
        try:
            part = selected(shape, wire.index)
        except IndexError:
            remedy = "count from 0" if shape else "leave it out"
            self.fault(link.draft.path, link.connection.place, misfit(wire, shape), remedy)
            return False
        if part is None:
            problem = f"the elements do not lie side by side, {source}"
            remedy = "take one element, or a run along the last axis"
            self.fault(link.draft.path, link.connection.place, problem, remedy)
            return False
        if wire.index:
            source = f"this part of '{wire.source}' has {shape_text(part[1])}"
        remedy = f"choose an element, such as '{wire.source}[0]'" if part[1] and not wire.index else ""
        return self._fit(link.draft, link.port, part[1], source, remedy)

    def _fit(self, draft: Draft, port: str, shape: Sequence[int], source: str, remedy: str = "") -> bool:
        signal = draft.interface.inputs[port].signal
        sizes = self.nodes[draft.path].sizes
        trial = dict(sizes)
        if signal.unify(tuple(shape), trial):
            sizes.update(trial)
            return True
        fixed = not signal.shape or set(signal.shape) & set(sizes)
        wanted = signal.resolve(sizes) if fixed else signal.shape
        problem = f"input '{port}' takes {shape_text(wanted)}, {source}"
        self.fault(draft.path, draft.connections[port].place, problem, remedy if not wanted else "")
        return False

    def settle(self, path: str) -> None:
        """Let constants fix sizes that wires leave open; sizes that stay open become a scalar or 1."""
        draft, node = self.drafts[path], self.nodes[path]
        for port, connection in draft.connections.items():
            if isinstance(connection.source, Constant) and (path, port) not in self.unknown:
                shape = np.shape(connection.source.value)
                if not self._fit(draft, port, shape, f"the constant has {shape_text(shape)}"):
                    self.unknown.add((path, port))
        if draft.block is UNKNOWN:
            return
        interface = node.block.interface
        undecided = {
            size for port, declared in interface.inputs.items() if (path, port) in self.unknown
            for size in declared.signal.shape
        }  # fmt: skip
        for declared in (*interface.outputs.values(), *interface.inputs.values()):
            for size in declared.signal.shape:
                if isinstance(size, str) and size not in undecided:
                    node.sizes.setdefault(size, () if size == "*" else 1)
