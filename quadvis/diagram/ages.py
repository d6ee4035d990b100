"""Ages that a diagram expects: a stamp is carried along the shortest path of wires, beside its blocks."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

from quadvis.diagram.draft import Connection, Draft, DraftWire, Key
from quadvis.diagram.reference import read_reference
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known, suggestion
from quadvis.graph.graph import Node, Wire, selected
from quadvis.graph.names import wire_text
from quadvis.links.stamps import AGE, HELD, HOLDER, METER, STAMP, AgeMeter, StampHolder, StampKeeper
from quadvis.units import Unit

KEY = "age"  # in an expectation
SECOND = Unit.parse("s")


class AgeRoute(NamedTuple):
    """A question: how old a stamp is when a block acts on it. ``written`` has the full names."""

    place: Place
    stamp: Wire
    block: str
    written: tuple[str, str]

    @property
    def path(self) -> str:
        """The path of the block that measures the age; its output is ``age``."""
        return f"{self.stem}/{_plain(self.block)}"

    @property
    def stem(self) -> str:
        """The beginning of the paths of all blocks that carry the stamp."""
        return f"{KEY}/{_plain(self.written[0])}"


def _plain(name: str) -> str:
    return "".join(each if each.isalnum() else "_" for each in name).strip("_")


class PathStep(NamedTuple):
    """One wire of a path: its reader, the input there."""

    reader: str
    port: str


def read_routes(node: YamlNode | None, wiring: Wiring, faults: Faults) -> list[AgeRoute]:
    """Return the ages for which a section of expectations asks."""
    found = []
    entries = Faults().collect(node.items) if node is not None else None  # reported with the section
    for entry in entries or ():
        if isinstance(entry, YamlMap) and KEY in entry:
            route = read_route(entry[KEY], wiring, faults)
            if known(route):
                found.append(route)
    return found


def read_route(node: YamlNode, wiring: Wiring, faults: Faults) -> AgeRoute | Unknown:
    """Read ``[eyes.stamp, outputs.sent]``: a signal, and a block or one of its signals."""
    names = faults.collect(node.items)
    if names is None:
        return UNKNOWN
    if len(names) != 2:
        remedy = "write such as 'age: [eyes.stamp, outputs.sent]'"
        faults.add(node.place, "'age' takes a stamp and the block that acts on it", remedy)
        return UNKNOWN
    stamp, block = _signal(names[0], wiring, faults), _block(names[1], wiring, faults)
    if not known(stamp) or not known(block):
        return UNKNOWN
    return AgeRoute(node.place, stamp, block[0], (wire_text(stamp), block[1]))


def _signal(node: YamlNode, wiring: Wiring, faults: Faults) -> Wire | Unknown:
    reference = read_reference(node, faults)
    found = wiring.find(wiring.expansion.root, reference).source if known(reference) else UNKNOWN
    if isinstance(found, YamlNode):
        faults.add(node.place, "this is a constant, not a signal", "name an output of a block")
    return found if isinstance(found, Wire) else UNKNOWN


def _block(node: YamlNode, wiring: Wiring, faults: Faults) -> tuple[str, str] | Unknown:
    """Return a block, and how it is written: by itself, or one of its outputs."""
    text = faults.collect(node.text)
    if text is None:
        return UNKNOWN
    if "." in text:
        wire = _signal(node, wiring, faults)
        return (wire.block, wire_text(wire)) if known(wire) else UNKNOWN
    blocks = wiring.expansion.blocks
    if text in blocks:
        return text, text
    if wiring.expansion.knows(text):
        remedy = suggestion(text, blocks) or "name a block that is no part, or one of its outputs"
        faults.add(node.place, f"there is no block '{text}'", remedy)
    return UNKNOWN


class AgePaths:
    """Puts the blocks that carry stamps beside those of a path.

    ``shadows`` are their wires beside wires of the diagram, by the key of those: they go the same way.
    """

    def __init__(self, drafts: Mapping[str, Draft], nodes: dict[str, Node], faults: Faults) -> None:
        self.drafts, self.nodes, self.faults = drafts, nodes, faults
        self.shadows: dict[Key, list[DraftWire]] = {}

    @cached_property
    def _readers(self) -> dict[str, list[PathStep]]:
        """The inputs that read each block, in the order of the names."""
        found: dict[str, list[PathStep]] = {}
        for path in sorted(self.drafts):
            for port, wire in self.nodes[path].wires():
                found.setdefault(wire.block, []).append(PathStep(path, port))
        return found

    def add(self, routes: Sequence[AgeRoute]) -> None:
        """Add what measures the ages; report those that nothing can measure."""
        for route in routes:
            steps = self._path(route)
            if known(steps) and self._is_stamp(route) and route.path not in self.nodes:
                self._carry(route, steps)

    def _fault(self, route: AgeRoute, problem: str, remedy: str) -> None:
        self.faults.add(route.place, problem, remedy, subject="expect")

    def _is_stamp(self, route: AgeRoute) -> bool:
        """Say whether a signal is one instant in seconds."""
        node, wire = self.nodes[route.stamp.block], route.stamp
        if wire.port not in node.units:
            return False
        try:
            part = selected(node.shape(wire.port), wire.index)
        except IndexError:
            part = None
        scalar = node.block.interface.outputs[wire.port].signal.scalar
        units = node.units[wire.port]
        right = part is not None and part[1] == () and scalar == "float64" and units[part[0]] == SECOND
        if not right:
            problem = f"'{route.written[0]}' is not an instant, one number in seconds"
            self._fault(route, problem, "name a stamp")
        return right

    def _path(self, route: AgeRoute) -> list[PathStep] | Unknown:
        """Return the shortest path of wires from the block of the stamp to the one that acts."""
        start, goal = route.stamp.block, route.block
        if start not in self.nodes or goal not in self.nodes:
            return UNKNOWN
        found: dict[str, list[PathStep]] = {start: []}
        waiting = deque([start])
        while waiting and goal not in found:
            block = waiting.popleft()
            for step in self._readers.get(block, ()):
                if step.reader not in found:
                    found[step.reader] = [*found[block], step]
                    waiting.append(step.reader)
        if goal not in found:
            if not self.faults:  # else a wire of the path may be missing
                problem = f"no wires lead from '{route.written[0]}' to '{goal}'"
                self._fault(route, problem, "name a block that acts on what was measured")
            return UNKNOWN
        return found[goal]

    def _carry(self, route: AgeRoute, steps: Sequence[PathStep]) -> None:
        source = route.stamp
        for step in steps:
            beside = self.nodes[step.reader]
            wire = beside.inputs[step.port]
            assert isinstance(wire, Wire)
            source = replace(source, crossing=wire.crossing)
            if step is steps[-1]:
                break
            through = step.port in beside.block.interface.feedthrough
            # The shortest paths from one stamp are a tree, so other routes pass the same one.
            path = f"{route.stem}/{_plain(step.reader)}/{STAMP}"
            if path not in self.nodes:
                self._put(path, StampHolder if through else StampKeeper, beside, source, step)
            source = Wire(path, HELD)
        self._put(route.path, AgeMeter, self.nodes[route.block], source, steps[-1] if steps else None)

    def _put(
        self,
        path: str,
        kind: type[AgeMeter | StampHolder | StampKeeper],
        beside: Node,
        source: Wire,
        step: PathStep | None,
    ) -> None:
        """Add one block beside another, which reads a stamp as the other one reads its input."""
        is_meter = kind is AgeMeter
        block = kind(period=beside.block.period)
        self.nodes[path] = Node(
            path, "age" if is_meter else "stamp", block, beside.task, {STAMP: source},
            units={AGE if is_meter else HELD: (SECOND,)}, computer=beside.computer,
            origin=METER if is_meter else HOLDER, hidden=not is_meter,
        )  # fmt: skip
        if step is not None:
            draft = self.drafts[step.reader]
            connection = Connection(draft.connections[step.port].place, source)
            made = replace(draft, path=path, type=kind, block=block, connections={STAMP: connection})
            shadow = DraftWire(made, STAMP, connection, source, block.interface.inputs[STAMP])
            self.shadows.setdefault((step.reader, step.port), []).append(shadow)
