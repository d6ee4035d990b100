"""Checks across wires: ports, kinds, shapes, units, rates and algebraic loops. All faults are collected.

Each check works on what the ones before it left whole, so that one mistake is told once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from quadvis.block import Block, In, Out, Shape, units_of
from quadvis.errors import Faults, Place, suggestion
from quadvis.graph import Constant, Node, Task, Wire, execution_order, selected
from quadvis.units import Unit, unify

Units = tuple[Unit, ...]


@dataclass
class Connection:
    """One input as the diagram gives it, with the place to name in a fault."""

    place: Place
    source: Wire | Constant | None  # None: there is nothing to check
    units: Units = ()  # of a constant, where the declaration leaves them open
    across: Place | None = None  # where the crossing is written
    told: bool = False  # its fault has been told already


@dataclass
class Draft:
    """A block whose name and parameters are right; its wires are not checked yet. ``task`` is None if unknown."""

    path: str
    place: Place
    kind: str
    block: Block
    task: Task | None
    connections: dict[str, Connection]
    param_units: dict[str, Units] = field(default_factory=dict)  # where the declaration leaves them open
    broken: set[str] = field(default_factory=set)  # inputs whose fault has been told already


class WireCheck:
    """Checks the wires between drafts, and turns them into the nodes of a graph."""

    def __init__(self, drafts: Sequence[Draft], unknown: set[str], faults: Faults) -> None:
        self.drafts = {draft.path: draft for draft in drafts}
        self.unknown = unknown  # blocks that are there but whose own faults leave nothing to check
        self.faults = faults
        self.nodes = {draft.path: self._node(draft) for draft in drafts}
        self.bindings: dict[str, list[dict[str, Unit]]] = {}

    def _node(self, draft: Draft) -> Node:
        task = draft.task or Task("unknown", Fraction(1))
        inputs: dict[str, Wire | Constant] = {
            name: Constant(port.default)
            for name, port in draft.block.interface.inputs.items()
            if port.default is not None
        }
        for name, connection in draft.connections.items():
            if connection.source is not None and name in draft.block.interface.inputs:
                inputs[name] = connection.source
            if connection.told:
                draft.broken.add(name)
        node = Node(draft.path, draft.kind, draft.block, task, inputs)
        for param in draft.block.interface.params.values():
            if param.signal.scalar != "str":
                value = getattr(draft.block, param.name)
                param.signal.unify(getattr(value, "shape", ()), node.sizes)
        return node

    def run(self) -> list[Node]:
        """Check everything; return the nodes in execution order if nothing was wrong."""
        self._check_ports()
        self._check_shapes()
        self._check_units()
        self._check_rates()
        if self.faults:
            # A loop through a wrong wire is no news; look for loops in what is right.
            self._drop_broken()
        order, loops = execution_order(list(self.nodes.values()))
        for loop in loops:
            self._tell_loop(loop)
        return order

    def _wires(self) -> Iterator[tuple[Draft, str, Connection, Wire, In]]:
        for draft in self.drafts.values():
            for port, connection in draft.connections.items():
                if port not in draft.broken and isinstance(connection.source, Wire):
                    yield draft, port, connection, connection.source, draft.block.interface.inputs[port]

    def _fault(self, draft: Draft, port: str, place: Place, problem: str, remedy: str = "") -> None:
        draft.broken.add(port)
        self.faults.add(place, problem, remedy, subject=f"block '{draft.path}'")

    def _check_ports(self) -> None:
        for draft in self.drafts.values():
            inputs = draft.block.interface.inputs
            for port, connection in draft.connections.items():
                if port not in inputs and not connection.told:
                    remedy = suggestion(port, inputs) or f"{draft.kind} has no inputs"
                    self._fault(draft, port, connection.place, f"{draft.kind} has no input '{port}'", remedy)
            missing = [p for p, declared in inputs.items() if p not in draft.connections and declared.default is None]
            for port in missing:
                self._fault(draft, port, draft.place, f"input '{port}' is not connected",
                            f"add '{port}: block.port' under 'in', or a constant")  # fmt: skip
        for draft, port, connection, wire, declared in self._wires():
            if wire.block in self.unknown:
                draft.broken.add(port)
            elif wire.block not in self.drafts:
                remedy = suggestion(wire.block, self.drafts)
                self._fault(draft, port, connection.place, f"there is no block '{wire.block}'", remedy)
            else:
                self._check_source(draft, port, connection, wire, declared)

    def _check_source(self, draft: Draft, port: str, connection: Connection, wire: Wire, declared: In) -> None:
        source = self.drafts[wire.block]
        outputs = source.block.interface.outputs
        if wire.port not in outputs:
            remedy = suggestion(wire.port, outputs) or f"{source.kind} has no outputs"
            self._fault(draft, port, connection.place, f"block '{wire.block}' has no output '{wire.port}'", remedy)
            return
        given, wanted = outputs[wire.port].signal.scalar, declared.signal.scalar
        if given != wanted:
            self._fault(draft, port, connection.place, f"input '{port}' takes {wanted}, '{wire.source}' is {given}",
                        "wire a port of the same kind")  # fmt: skip

    def _check_shapes(self) -> None:
        """Let known shapes flow along the wires until nothing changes; then give the rest its default, one by one."""
        self._fit_constants()
        waiting = {(draft.path, port) for draft, port, *_ in self._wires()}
        while waiting:
            before = len(waiting)
            for draft, port, connection, wire, _ in self._wires():
                key = (draft.path, port)
                if key in waiting and self._known(wire):
                    waiting.discard(key)
                    self._flow(draft, port, connection, wire)
            if len(waiting) == before:
                path, port = min(waiting)
                wire = self.drafts[path].connections[port].source
                assert isinstance(wire, Wire)
                source = self.nodes[wire.block]
                declared_out = source.block.interface.outputs[wire.port].signal
                declared_out.unify(declared_out.resolve(source.sizes), source.sizes)

    def _fit_constants(self) -> None:
        for draft in self.drafts.values():
            for port, connection in draft.connections.items():
                if isinstance(connection.source, Constant) and port not in draft.broken:
                    shape = np.shape(connection.source.value)
                    self._fit(draft, port, connection, shape, f"the constant has {_words(shape)}")

    def _known(self, wire: Wire) -> bool:
        source = self.nodes[wire.block]
        signal = source.block.interface.outputs[wire.port].signal
        return all(size in source.sizes for size in signal.shape if isinstance(size, str))

    def _flow(self, draft: Draft, port: str, connection: Connection, wire: Wire) -> None:
        shape = self.nodes[wire.block].shape(wire.port)
        try:
            part = selected(shape, wire.index)
        except IndexError:
            self._fault(draft, port, connection.place, f"'{wire.source}' has {_words(shape)}, not what the index takes",
                        "count from 0")  # fmt: skip
            return
        if part is None:
            self._fault(draft, port, connection.place, f"this part of '{wire.source}' does not lie in one piece",
                        "take an element, or a run along the last axis")  # fmt: skip
            return
        remedy = f"choose an element, such as '{wire.source}[0]'" if part[1] and not wire.index else ""
        self._fit(draft, port, connection, part[1], f"'{wire.source}' has {_words(part[1])}", remedy)

    def _fit(
        self, draft: Draft, port: str, connection: Connection, shape: Shape, found: str, remedy: str = ""
    ) -> None:
        """Match what an input is given against what it takes, which may fix sizes of the block."""
        signal = draft.block.interface.inputs[port].signal
        sizes = self.nodes[draft.path].sizes
        trial = dict(sizes)
        if signal.unify(shape, trial):
            sizes.update(trial)
            return
        known = not signal.shape or set(signal.shape) & set(sizes)
        wanted = signal.resolve(sizes) if known else signal.shape
        self._fault(draft, port, connection.place, f"input '{port}' takes {_words(wanted)}, {found}",
                    remedy if not wanted else "")  # fmt: skip

    def _check_units(self) -> None:
        """The same for unit variables: a block's outputs have units once its inputs' are known."""
        self.bindings = {path: [] for path in self.nodes}
        self._bind_constants()
        waiting = {(draft.path, port) for draft, port, *_ in self._wires()}
        forced = False
        while waiting:
            before = len(waiting)
            for draft, port, connection, wire, declared in self._wires():
                key = (draft.path, port)
                units = self._units(wire, forced) if key in waiting else None
                if units is not None:
                    forced = False
                    waiting.discard(key)
                    self._match(draft, port, connection, declared, units, f"'{wire.source}'")
            # Variables that nothing fixed, in a ring of blocks, count as plain numbers: one at a time.
            if len(waiting) == before:
                if forced:
                    break
                forced = True

        for path, node in self.nodes.items():
            for name, declared in node.block.interface.outputs.items():
                node.units[name] = self._elements(declared, node, path, True) or ()

    def _bind_constants(self) -> None:
        for draft in self.drafts.values():
            for name, units in draft.param_units.items():
                bindings = self.bindings[draft.path]
                bindings += [{} for _ in range(len(units) - len(bindings))]
                for wanted, unit, known in zip(units_of(draft.block.interface.params[name], len(units)), units, bindings, strict=False):
                    unify(wanted, unit, known)
            for port, connection in draft.connections.items():
                if port not in draft.broken and connection.units:
                    declared = draft.block.interface.inputs[port]
                    self._match(draft, port, connection, declared, connection.units, "the constant")

    def _units(self, wire: Wire, forced: bool) -> Units | None:
        """Return the units of a wire's elements, None while a variable is open."""
        node = self.nodes[wire.block]
        declared = node.block.interface.outputs[wire.port]
        units = self._elements(declared, node, wire.block, forced)
        if units is None or not wire.index:
            return units
        part = selected(node.shape(wire.port), wire.index)
        assert part is not None
        count = 1
        for length in part[1]:
            count *= length
        return units[part[0] : part[0] + count]

    def _elements(self, declared: Out, node: Node, path: str, forced: bool) -> Units | None:
        count = 1
        for length in node.shape(declared.name):
            count *= length
        bindings = self.bindings[path]
        units = []
        for element, unit in enumerate(units_of(declared, count)):
            if unit.variables:
                known = bindings[min(element, len(bindings) - 1)] if bindings else {}
                if not forced and not unit.variables <= set(known):
                    return None
                unit = unit.substitute({name: known.get(name, Unit.parse("1")) for name in unit.variables})
            units.append(unit)
        return tuple(units)

    def _match(self, draft: Draft, port: str, connection: Connection, declared: In, units: Units, source: str) -> None:
        bindings = self.bindings[draft.path]
        while len(bindings) < len(units):
            bindings.append(dict(bindings[0]) if bindings else {})
        for element, (wanted, unit) in enumerate(zip(units_of(declared, len(units)), units, strict=False)):
            if not unify(wanted, unit, bindings[element]):
                where = f"input '{port}'" + (f"[{element}]" if len(units) > 1 else "")
                shown = wanted.substitute(bindings[element])
                self._fault(draft, port, connection.place, f"{where} takes {shown}, {source} has {unit}",
                            "wire a signal of that unit")  # fmt: skip
                return

    def _check_rates(self) -> None:
        for draft, port, connection, wire, _ in self._wires():
            source = self.drafts[wire.block]
            if draft.task is None or source.task is None or draft.task == source.task:
                continue
            problem, remedy = crossing_fault(source.task, draft.task, wire.crossing)
            if problem:
                text = f"'{wire.source}' ({rate_text(source.task)}) into '{port}' ({rate_text(draft.task)}): {problem}"
                self._fault(draft, port, connection.across or connection.place, text, remedy)

    def _drop_broken(self) -> None:
        for draft in self.drafts.values():
            for port in draft.broken:
                self.nodes[draft.path].inputs.pop(port, None)

    def _tell_loop(self, loop: list[tuple[str, str]]) -> None:
        """Say the loop in the direction of the signal."""
        path, port = loop[0]
        steps = [f"{name}.{entered}" for name, entered in reversed(loop)]
        place = self.drafts[path].connections[port].place
        self.faults.add(
            place,
            "algebraic loop: " + " -> ".join([*steps, steps[0]]),
            "break it with 'across: delay' on one of these wires, or with a block that holds a state",
            subject=f"block '{path}'",
        )


def crossing_fault(source: Task, target: Task, crossing: str | None) -> tuple[str, str]:
    """Return what is wrong with a wire between two rates and what would be right; two empty texts if nothing is."""
    slower = source.period > target.period or target.continuous
    fitting = "hold" if slower and not source.continuous else "sample"
    if crossing is None:
        return "the wire does not say how it crosses between rates", f"add 'across: {fitting}' (or delay, newest)"
    ratio = source.period / target.period if slower else target.period / source.period
    if crossing != "newest" and ratio.denominator != 1:
        return (
            f"the periods are in the ratio {ratio}, not commensurate for 'across: {crossing}'",
            "write 'across: newest', or choose rates of which one divides the other",
        )
    if crossing == "sample" and fitting == "hold":
        return "'across: sample' is for a faster producer", "write 'across: hold' or 'across: delay'"
    if crossing == "hold" and fitting == "sample" and source.period != target.period:
        return "'across: hold' is for a slower producer", "write 'across: sample'"
    return "", ""


def rate_text(task: Task) -> str:
    """Return a task's name and period as a message shows them."""
    frequency = 1 / task.period
    rate = f"{frequency} Hz" if frequency.denominator == 1 else f"{float(task.period):g} s"
    return f"{task.name}, {rate}"


def _words(shape: Shape | tuple[int | str, ...]) -> str:
    if not shape:
        return "one value"
    return f"{' x '.join(map(str, shape))} values"
