"""Checks across wires: ports, kinds, shapes, units, rates and algebraic loops. All faults are collected.

Each check skips values that are `UNKNOWN`, and makes wrong values `UNKNOWN`: one mistake is reported once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import cast

from quadvis.block import Block
from quadvis.diagram.ages import AgePaths, AgeRoute
from quadvis.diagram.draft import Draft, DraftWire, Key, not_taken, unconnected
from quadvis.diagram.flow import Cases
from quadvis.diagram.names import absent, remedy_for
from quadvis.diagram.routing import Network, Routing, crosses
from quadvis.diagram.shape_flow import ShapeFlow
from quadvis.diagram.times import rate_text
from quadvis.diagram.unit_repair import follow_units
from quadvis.diagram.values import shape_text
from quadvis.errors import UNKNOWN, Faults, Place, known
from quadvis.graph.graph import MULTI, SINGLE, Constant, Node, Task, Wire
from quadvis.graph.order import CONDITION, execution_order
from quadvis.graph.tasking import with_transitions
from quadvis.links.insertion import receivers_first

_ANY_TASK = Task("unknown", Fraction(1))  # a node needs one; no check looks at it


class WireCheck:
    """Checks the wires between drafts, and turns them into the nodes of a graph."""

    def __init__(
        self,
        drafts: Sequence[Draft],
        faults: Faults,
        cases: Cases,
        network: Network,
        routes: Sequence[AgeRoute] = (),
        tasking: str = SINGLE,
    ) -> None:
        self.drafts = {draft.path: draft for draft in drafts}
        self.faults, self.cases, self.network = faults, cases, network
        self.routes, self.tasking = routes, tasking
        self.unknown: set[Key] = set()  # inputs of which nothing is known
        self.nodes = {draft.path: self._node(draft) for draft in drafts}

    def _node(self, draft: Draft) -> Node:
        interface = draft.interface
        inputs: dict[str, Wire | Constant] = {
            name: Constant(port.default)
            for name, port in interface.inputs.items()
            if port.default is not None
        }
        for name, connection in draft.connections.items():
            if connection.source is not UNKNOWN and name in interface.inputs:
                inputs[name] = connection.source
        task = draft.task if known(draft.task) else _ANY_TASK
        # Of a block whose parameters are unknown only the declarations are looked at, which its class has.
        block = draft.block if known(draft.block) else cast(Block, draft.type)
        computer = draft.computer if known(draft.computer) else ""
        condition = draft.condition if known(draft.condition) and draft.condition in self.drafts else ""
        node = Node(
            draft.path, draft.kind, block, task, inputs, stream=draft.stream, computer=computer,
            condition=condition,
        )  # fmt: skip
        node.sizes.update(block.entry_counts)
        for name, param in interface.params.items() if known(draft.block) else ():
            shape = getattr(getattr(draft.block, name), "shape", ())
            if param.signal.scalar != "str" and not param.signal.unify(shape, node.sizes):
                wanted = shape_text(param.signal.resolve(node.sizes))
                problem = f"{name} has {shape_text(shape)}, the other parameters make it {wanted}"
                self._fault(draft, draft.places.get(name, draft.place), problem)
        return node

    def run(self) -> list[Node]:
        """Check everything; return the nodes in execution order if nothing was wrong."""
        links = list(self._links())
        self._check_connected()
        self._check_rates(links)
        shapes = ShapeFlow(self.drafts, self.nodes, self._known(links), self.unknown, self.faults, self.cases)
        shapes.run()
        self.unknown = shapes.unknown
        units = follow_units(
            self.drafts, self.nodes, self._known(links), self.unknown, self.faults, self.cases
        )
        unknown = units.unknown | {link.key for link in links if link.connection.across is UNKNOWN}
        for path, port in unknown:
            # A loop through such a wire would be reported twice.
            self.nodes[path].inputs.pop(port, None)
        whole = {link.key for link in links if self._is_whole(link)} - unknown - self.unknown
        ages = AgePaths(self.drafts, self.nodes, self.faults)
        ages.add(self.routes)
        Routing(self.drafts, self.nodes, self.network, self.faults).run(links, whole, ages.shadows)
        if self.tasking == MULTI:
            with_transitions(self.nodes.values())
        order, loops = execution_order(receivers_first(self.nodes.values()))
        conditions = {node.condition for node in self.nodes.values()}
        reported: set[str] = set()  # conditions, which lead to loops through many blocks of a part
        for loop in loops:
            mine = {path for path, _ in loop if path in conditions}
            if not mine & reported:
                self._report_loop(loop)
            reported |= mine
        return order

    def _is_whole(self, link: DraftWire) -> bool:
        """Say whether all is known of the signal that a wire carries."""
        wire = link.wire
        return known(self.drafts[wire.block].block) and wire.port in self.nodes[wire.block].units

    def _known(self, links: Sequence[DraftWire]) -> list[DraftWire]:
        return [link for link in links if link.key not in self.unknown]

    def _fault(self, draft: Draft, place: Place, problem: str, remedy: str = "") -> None:
        self.faults.add(place, problem, remedy, subject=f"block '{draft.path}'")

    def _links(self) -> Iterator[DraftWire]:
        """Yield the wires whose two ports exist; the others are reported."""
        for draft in self.drafts.values():
            inputs = draft.interface.inputs
            for port, connection in draft.connections.items():
                wire = connection.source
                if port not in inputs and draft.inherits:
                    self._fault(draft, draft.place, *not_taken(port, draft.kind))
                elif port not in inputs:
                    remedy = remedy_for(port, draft.connections, inputs)
                    if port in draft.interface.params:
                        remedy = "it is a parameter; write it under 'with'"
                    self._fault(draft, connection.place, f"{draft.kind} has no input '{port}'", remedy)
                elif isinstance(wire, Wire) and wire.block in self.drafts:
                    link = DraftWire(draft, port, connection, wire, inputs[port])
                    if self._is_right_kind(link):
                        yield link
                    else:
                        self.unknown.add(link.key)
                elif not isinstance(wire, Constant):
                    self.unknown.add((draft.path, port))

    def _check_connected(self) -> None:
        for draft in self.drafts.values():
            inputs = draft.interface.inputs
            wanted = [port for port in draft.interface.wanted if port not in draft.connections]
            if not wanted:
                continue
            self.unknown |= {(draft.path, port) for port in wanted}
            for port in absent(wanted, draft.connections, inputs):
                self._fault(draft, draft.place, *unconnected(port, inputs[port]))

    def _is_right_kind(self, link: DraftWire) -> bool:
        wire, wanted = link.wire, link.declared.signal.scalar
        outputs = self.drafts[wire.block].interface.outputs
        given = outputs[wire.port].signal.scalar
        if given == wanted:
            return True
        fitting = [name for name, port in outputs.items() if port.signal.scalar == wanted]
        between = "logic.compare" if wanted == "bool" else "math.convert"
        remedy = f"use a block '{between}'" if "frame" not in (wanted, given) else f"wire a {wanted} signal"
        remedy = f"'{wire.block}.{fitting[0]}' is {wanted}" if len(fitting) == 1 else remedy
        problem = f"input '{link.port}' takes {wanted}, '{wire.source}' is {given}"
        self._fault(link.draft, link.connection.place, problem, remedy)
        return False

    def _check_rates(self, links: Sequence[DraftWire]) -> None:
        reported: set[Place] = set()  # one wire may lead to several blocks of a part
        for link in links:
            draft, port, connection, wire, _ = link
            source = self.drafts[wire.block].task
            across = connection.across
            if draft.task is UNKNOWN or source is UNKNOWN or across is UNKNOWN or draft.task == source:
                continue
            if crosses(self.drafts, link):
                continue  # a link gives the newest value that has come, whatever the rates
            problem, remedy = crossing_fault(source, draft.task, wire.crossing)
            if problem and connection.place not in reported:
                reported.add(connection.place)
                ends = f"'{wire.source}' ({rate_text(source)}) into '{port}' ({rate_text(draft.task)})"
                self._fault(draft, across or connection.place, f"{ends}: {problem}", remedy)

    def _report_loop(self, loop: list[Key]) -> None:
        """Say the loop in the direction of the signal; what decides over itself begins at its condition."""
        runs = next((number for number, (_, port) in enumerate(loop, 1) if port == CONDITION), 0) % len(loop)
        loop = loop[runs:] + loop[:runs]
        path, port = loop[0]
        steps = [
            name if entered == CONDITION else f"{name}.{entered}"
            for name, entered in (loop[0], *reversed(loop))
        ]
        remedy = "break it with 'across: delay' on one of these wires, or with a block that holds a state"
        place = self.drafts[path].connections[port].place
        self._fault(self.drafts[path], place, "algebraic loop: " + " -> ".join(steps), remedy)


def crossing_fault(source: Task, target: Task, crossing: str | None) -> tuple[str, str]:
    """Return the problem and the remedy of a wire between two rates; ("", "") if it is right."""
    slower = source.period > target.period or target.continuous
    fitting = "hold" if slower and not source.continuous else "sample"
    ratio = source.period / target.period if slower else target.period / source.period
    # Every period is a whole number of solver steps; where it is not, the step has been reported.
    divides = ratio.denominator == 1 or source.continuous or target.continuous
    if crossing is None:
        fitting = fitting if divides else "newest"
        return "the wire does not say how it crosses between rates", f"add 'across: {fitting}'"
    if crossing != "newest" and not divides:
        return (
            f"the periods are in the ratio {ratio}, not commensurate for 'across: {crossing}'",
            "write 'across: newest', or choose rates of which one divides the other",
        )
    if crossing == "sample" and fitting == "hold":
        return "'across: sample' is for a faster producer", "write 'across: hold' or 'across: delay'"
    if crossing == "hold" and fitting == "sample" and source.period != target.period:
        return "'across: hold' is for a slower producer", "write 'across: sample'"
    return "", ""
