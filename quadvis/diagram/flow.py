"""What flows along wires before anything runs: shapes, then units, from what is declared and given."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from quadvis.block import Block, In
from quadvis.diagram.reference import index_text
from quadvis.diagram.values import OpenUnits, shape_text
from quadvis.engine.graph import Constant, Node, Task, Wire, selected
from quadvis.errors import Faults, Place
from quadvis.units import Unit

ONE = Unit()
Key = tuple[str, str]  # block and input


@dataclass
class Connection:
    """One input as the diagram gives it, with the place to name in a fault."""

    place: Place
    source: Wire | Constant | None  # None: there is nothing to check
    units: OpenUnits = ()  # of a constant, where the declaration leaves them open
    across: Place | None = None  # where the crossing is written


@dataclass
class Draft:
    """A block whose wires are not checked yet.

    ``block`` is the class alone if the parameters are wrong: what depends on them is not looked at. ``task``
    is None if the rate is.
    """

    path: str
    place: Place
    kind: str
    block: Block | type[Block]
    task: Task | None
    connections: dict[str, Connection]
    places: Mapping[str, Place] = field(default_factory=dict)  # of the parameters that are given
    units: Mapping[str, OpenUnits] = field(default_factory=dict)  # of the parameters where they are open
    told: bool = False  # that its inputs cannot be read

    @property
    def whole(self) -> bool:
        """True if its parameters are known."""
        return isinstance(self.block, Block)


class Link(NamedTuple):
    """A wire between two ports that there are."""

    draft: Draft
    port: str
    connection: Connection
    wire: Wire
    declared: In

    @property
    def key(self) -> Key:
        """What tells it from all others."""
        return self.draft.path, self.port


class Flow:
    """Lets what is known flow along the wires until all is known, each block after the blocks that feed it.

    ``lost`` are inputs of which nothing is known, since their fault has been told: what depends on them is
    not looked at. In a ring of blocks nothing comes first; there one block goes ahead with what it has.
    """

    def __init__(self, drafts: Mapping[str, Draft], nodes: Mapping[str, Node], links: Sequence[Link],
                 lost: Collection[Key], faults: Faults) -> None:  # fmt: skip
        self.drafts, self.nodes, self.faults = drafts, nodes, faults
        self.lost = set(lost)
        self._waiting = {link.key: link for link in links}
        self._settled: set[str] = set()
        self._told: set[Place] = set()
        self._rank = {path: rank for rank, path in enumerate(drafts)}
        self._into: dict[str, list[Link]] = {path: [] for path in drafts}
        self._from: dict[str, list[Link]] = {path: [] for path in drafts}
        for link in links:
            self._into[link.draft.path].append(link)
            self._from[link.wire.block].append(link)

    def run(self) -> None:
        """Follow every wire."""
        for path in self.drafts:
            if not self._pending(path):
                self._settle(path)
        while self._waiting:
            self._settle(self._first_in_ring())

    def _pending(self, path: str) -> list[Link]:
        return [link for link in self._into[path] if link.key in self._waiting]

    def _first_in_ring(self) -> str:
        """Walk against the signals until a block comes again; return the one of that ring that knows most."""
        path = next(iter(self._waiting.values())).wire.block
        trail: dict[str, None] = {}
        while path not in trail:
            trail[path] = None
            path = self._pending(path)[0].wire.block
        ring = list(trail)[list(trail).index(path) :]
        return min(ring, key=lambda member: (-self.knowledge(member), self._rank[member]))

    def _settle(self, path: str) -> None:
        self._settled.add(path)
        self.settle(path)
        changed = [path]
        while changed:
            path = changed.pop()
            for link in self._from[path]:
                if link.key in self._waiting and (self.knows(link) or path in self._settled):
                    del self._waiting[link.key]
                    if not self.knows(link) or not self.take(link):
                        self.lost.add(link.key)
                    if link.draft.path not in self._settled and not self._pending(link.draft.path):
                        self._settled.add(link.draft.path)
                        self.settle(link.draft.path)
                    changed.append(link.draft.path)

    def fault(self, path: str, place: Place, problem: str, remedy: str = "") -> None:
        """Tell a fault of a block, once for a wire that leads to several blocks of a part."""
        if place not in self._told:
            self._told.add(place)
            self.faults.add(place, problem, remedy, subject=f"block '{path}'")

    def knows(self, link: Link) -> bool:
        """Say whether what comes along a wire is known."""
        raise NotImplementedError

    def take(self, link: Link) -> bool:
        """Give it to the consumer; False if it does not fit, which is told."""
        raise NotImplementedError

    def settle(self, path: str) -> None:
        """Decide what is still open in a block, since no more will be known."""
        raise NotImplementedError

    def knowledge(self, path: str) -> int:
        """Return how well a block can go ahead in a ring; higher is better."""
        return 0


def misfit(wire: Wire, shape: Sequence[int]) -> str:
    """Say that an index goes beyond a signal."""
    return f"index {index_text(wire.index)} does not fit '{wire.source}', which has {shape_text(shape)}"


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
        signal = draft.block.interface.inputs[port].signal
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
        """Let constants fix what wires do not; sizes that nothing fixes become a scalar or 1."""
        draft, node = self.drafts[path], self.nodes[path]
        for port, connection in draft.connections.items():
            if isinstance(connection.source, Constant) and (path, port) not in self.lost:
                shape = np.shape(connection.source.value)
                if not self._fit(draft, port, shape, f"the constant has {shape_text(shape)}"):
                    self.lost.add((path, port))
        if not draft.whole:
            return
        interface = node.block.interface
        doubtful = {
            size for port, declared in interface.inputs.items() if (path, port) in self.lost
            for size in declared.signal.shape
        }  # fmt: skip
        for declared in (*interface.outputs.values(), *interface.inputs.values()):
            for size in declared.signal.shape:
                if isinstance(size, str) and size not in doubtful:
                    node.sizes.setdefault(size, () if size == "*" else 1)
