"""The picture of a diagram with faults: what is known of it, with the faulty blocks and ports marked.

Nothing of it can run; people look at it to find out what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

from quadvis.diagram.assembly import Assembly
from quadvis.diagram.draft import Draft
from quadvis.diagram.joined import joined
from quadvis.diagram.picture import drawn_block, part_of
from quadvis.diagram.reference import Reference
from quadvis.diagram.scope import FlatBlock
from quadvis.diagram.times import rate_text
from quadvis.document import YamlScalar
from quadvis.errors import Fault, known, sentence
from quadvis.graph.graph import Node, Task, Wire
from quadvis.graph.names import index_text, wire_text
from quadvis.output.draw import draw
from quadvis.output.drawn import DrawnBlock, DrawnWire
from quadvis.output.folding import DrawnPicture

NO_RATE = Task("", Fraction(1))
_BLOCK = re.compile(r"block '([^']+)'")
_INPUT = re.compile(r"(?:input|into) '([^']+)'")
_LOOP = "algebraic loop: "


def draw_faulty(
    assembly: Assembly, faults: Sequence[Fault], *, part: str = "", depth: int | None = None
) -> str:
    """Return a picture of the diagram that has these faults, as SVG, with their sentences below it."""
    picture, tasks = _Sketch(assembly, faults).picture()
    picture = part_of(picture, part, depth)
    name = assembly.spec.name if isinstance(assembly.spec.name, str) else assembly.spec.path.stem
    title = f"{name}: {part}" if part else name
    return draw(
        title, picture.blocks, picture.wires, picture.constants, tasks, notes=[str(fault) for fault in faults]
    )


@dataclass
class _Box:
    """A block on its way into the picture."""

    flat: FlatBlock
    draft: Draft | None
    inputs: dict[str, None] = field(default_factory=dict)
    outputs: dict[str, None] = field(default_factory=dict)
    faulty: dict[str, str] = field(default_factory=dict)


class _Sketch:
    def __init__(self, assembly: Assembly, faults: Sequence[Fault]) -> None:
        drafts = {draft.path: draft for draft in assembly.drafts}
        self.boxes = {path: _Box(flat, drafts.get(path)) for path, flat in assembly.flat.items()}
        self.wires: list[DrawnWire] = []
        self.constants: dict[tuple[str, str], str] = {}
        self.ports = dict(assembly.part_ports)
        for path, box in self.boxes.items():
            self._fill(path, box)
        for fault in faults:
            self._mark(fault)

    def picture(self) -> tuple[DrawnPicture, dict[str, str]]:
        """Return the picture, and the words of the legend by task."""
        blocks = [self._drawn(path, box) for path, box in self.boxes.items()]
        tasks = {}
        for box in self.boxes.values():
            task = _task(box.draft)
            tasks[task.name] = "no rate" if task is NO_RATE else rate_text(task)
        faulty = {
            (path, port): words for path, box in self.boxes.items() for port, words in box.faulty.items()
        }
        wires = [
            replace(wire, fault=faulty.get((wire.target_block, wire.target_port), "")) for wire in self.wires
        ]
        return joined(DrawnPicture(blocks, wires, self.constants, self.ports)), tasks

    def _fill(self, path: str, box: _Box) -> None:
        """Note the ports of a block, and what leads to its inputs."""
        draft, specs = box.draft, box.flat.spec.inputs
        written = specs if specs is not None and known(specs) else {}
        if draft is None:
            box.inputs.update(dict.fromkeys(written))
        else:
            box.inputs.update(dict.fromkeys([*draft.interface.wanted, *draft.connections]))
            box.outputs.update(dict.fromkeys(draft.interface.outputs))
        connections = draft.connections if draft is not None else {}
        for port in box.inputs:
            source = connections[port].source if port in connections else None
            if isinstance(source, Wire) and source.block in self.boxes:
                self.boxes[source.block].outputs[source.port] = None
                self.wires.append(DrawnWire(wire_text(source), path, port, source.crossing))
                continue
            name, _, number = port.rstrip("]").partition("[")
            spec = written.get(name)
            entry = spec.entries[int(number)] if spec is not None and number else spec
            if entry is not None:
                self._unresolved(path, port, box, entry.source)

    def _unresolved(self, path: str, port: str, box: _Box, source: object) -> None:
        """Note an input whose source is a constant, or was not found."""
        if isinstance(source, YamlScalar):
            self.constants[path, port] = source.value
        if not isinstance(source, Reference):
            return
        text = f"{source.block}.{source.port}{index_text(source.index)}"
        there = self.boxes.get(box.flat.scope.prefix + source.block)
        if there is None:
            self.constants[path, port] = text
            return
        there.outputs[source.port] = None
        self.wires.append(DrawnWire(box.flat.scope.prefix + text, path, port))

    def _mark(self, fault: Fault) -> None:
        """Mark the block and the port that a fault is about."""
        found = _BLOCK.search(fault.subject)
        box = self.boxes.get(found[1]) if found else None
        if box is None:
            return
        words = sentence(fault.problem, fault.remedy)
        if fault.problem.startswith(_LOOP):
            for name in fault.problem.removeprefix(_LOOP).split(" -> "):
                path, _, port = name.rpartition(".")
                if path in self.boxes:  # a condition stands there, too, by its name alone
                    self.boxes[path].faulty.setdefault(port, words)
            return
        box.faulty.setdefault(self._port(box, fault), words)

    @staticmethod
    def _port(box: _Box, fault: Fault) -> str:
        """Return the input that a fault is about; "" if it is about the block as a whole."""
        connections = box.draft.connections if box.draft is not None else {}
        at = [port for port, each in connections.items() if fault.place in (each.place, each.across)]
        named = [name for name in _INPUT.findall(fault.problem) if name in box.inputs]
        return next((name for name in named if name in at), next(iter(named or at), ""))

    @staticmethod
    def _drawn(path: str, box: _Box) -> DrawnBlock:
        inputs, outputs, task = tuple(box.inputs), tuple(box.outputs), _task(box.draft).name
        kind, draft = box.flat.spec.kind, box.draft
        if draft is None:
            made = DrawnBlock(path, kind if isinstance(kind, str) else "", inputs, outputs, task)
        elif known(draft.block):
            node = Node(path, draft.kind, draft.block, _task(draft), {})
            made = replace(drawn_block(node, inputs), outputs=outputs)
        else:
            made = DrawnBlock(path, draft.kind, inputs, outputs, task, symbol=draft.type.symbol)
        return replace(made, faulty=box.faulty)


def _task(draft: Draft | None) -> Task:
    return draft.task if draft is not None and known(draft.task) else NO_RATE
