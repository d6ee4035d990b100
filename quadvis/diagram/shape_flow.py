"""Shapes along wires."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np

from quadvis.block import Shape, Sizes
from quadvis.diagram.draft import Draft, DraftWire, misfit
from quadvis.diagram.flow import Flow
from quadvis.diagram.values import shape_text
from quadvis.errors import UNKNOWN
from quadvis.graph.graph import Constant, selected
from quadvis.graph.names import index_text


class ShapeFlow(Flow):
    """Shapes: fixes the symbolic sizes of every node."""

    def knows(self, link: DraftWire) -> bool:
        """Say whether the producer's sizes are fixed."""
        node = self.nodes[link.wire.block]
        symbols = node.block.interface.outputs[link.wire.port].signal.symbols
        return all(size in node.sizes for size in symbols)

    def case(self, path: str, links: Sequence[DraftWire]) -> Hashable:
        """Return the shapes that come in and those of its constants; parameters have fixed some sizes."""
        draft = self.drafts[path]
        constants = [
            (port, np.shape(connection.source.value))
            for port, connection in draft.connections.items()
            if isinstance(connection.source, Constant)
        ]
        return (
            draft.block is UNKNOWN,
            tuple(self.nodes[path].sizes.items()),
            tuple([(link.port, self._shape(link), index_text(link.wire.index)) for link in links]),
            tuple(constants),
            self.undecided(path),
        )

    def _shape(self, link: DraftWire) -> Shape | None:
        return self.nodes[link.wire.block].shape(link.wire.port) if self.knows(link) else None

    def found(self, path: str) -> Sizes:
        """Return the sizes of a block."""
        return dict(self.nodes[path].sizes)

    def adopt(self, path: str, found: Sizes) -> None:
        """Take these sizes."""
        self.nodes[path].sizes.update(found)

    def take(self, link: DraftWire) -> bool:
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
        fixed = not signal.shape or set(signal.symbols) & set(sizes)
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
        undecided = {size for port in self.undecided(path) for size in interface.inputs[port].signal.symbols}
        for declared in (*interface.outputs.values(), *interface.inputs.values()):
            for size in declared.signal.symbols:
                if size not in undecided:
                    node.sizes.setdefault(size, () if size == "*" else 1)
