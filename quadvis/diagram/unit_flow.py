"""The flow of units along wires: the units of its inputs bind the unit variables of a block."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence

from quadvis.block import Declared, Sizes
from quadvis.diagram.bindings import ONE, Bindings, variable_of
from quadvis.diagram.draft import DraftWire, Key
from quadvis.diagram.flow import Flow
from quadvis.diagram.values import Bare, OpenUnits
from quadvis.errors import UNKNOWN, Place, known
from quadvis.graph.graph import Constant, selected
from quadvis.units import Unit


class UnitFlow(Flow):
    """Units: binds the variables of every block, and fills in the units of every node."""

    changed: Mapping[Key, Unit] = {}  # factors of given values, to try what another unit would do

    def run(self) -> None:
        """Follow every wire."""
        self.bindings = {path: Bindings() for path in self.drafts}
        self._prepared: set[str] = set()  # blocks whose given values have been used
        # Of units that do not fit: what there is over what is wanted, of wires and of given values.
        self.ratios: dict[Place, Unit] = {}
        self.given_ratios: dict[Place, Unit] = {}
        self.integrals: set[Place] = set()  # wires with the integral of a plain number, where none fits
        super().run()

    def note(self) -> None:
        """Note the units of all ports and parameters; blocks of one case and with equal sizes share them."""
        for path, node in self.nodes.items():
            draft, block = self.drafts[path], self.drafts[path].block
            params = draft.interface.params if known(block) else {}
            counts = {name: int(getattr(getattr(block, name), "size", 1)) for name in params}
            case = (self.bindings[path], draft.type, tuple(node.sizes.items()), tuple(counts.values()))
            if case not in self.cases:
                inputs, outputs = draft.interface.inputs, draft.interface.outputs
                counts |= {name: math.prod(node.shape(name)) for name in (*inputs, *outputs)}
                every = {**params, **outputs, **inputs}  # a formula and its output have one name
                self.cases[case] = dict(self._noted(self.bindings[path], every, counts, node.sizes))
            node.units.update(self.cases[case])

    @staticmethod
    def _noted(
        bindings: Bindings, declared: Mapping[str, Declared], counts: Mapping[str, int], sizes: Sizes
    ) -> Iterator[tuple[str, tuple[Unit, ...]]]:
        for name, item in declared.items():
            parts = item.signal.parts(sizes) if item.signal.is_sum else ()
            units = bindings.units(item, counts[name], parts)
            if not any(unit.variables for unit in units):
                yield name, tuple([unit.reduced for unit in units])

    def _of(self, link: DraftWire) -> tuple[Unit, ...]:
        wire = link.wire
        node = self.nodes[wire.block]
        shape = node.shape(wire.port)
        declared = node.block.interface.outputs[wire.port]
        parts = declared.signal.parts(node.sizes) if declared.signal.is_sum else ()
        units = self.bindings[wire.block].units(declared, math.prod(shape), parts)
        part = selected(shape, wire.index)
        assert part is not None, "the shapes have been checked"
        return units[part[0] : part[0] + math.prod(part[1])]

    def case(self, path: str, links: Sequence[DraftWire]) -> Hashable:
        """Return the units that come in, and those of the values that are given."""
        return (
            self.drafts[path].block is UNKNOWN,
            tuple([(link.port, self._of(link) if self.knows(link) else None) for link in links]),
            tuple([(name, units) for name, _, units in self._given(path)]),
            self.undecided(path),
        )

    def found(self, path: str) -> Bindings:
        """Return the bindings of a block, which are final then."""
        return self.bindings[path]

    def adopt(self, path: str, found: Bindings) -> None:
        """Share these bindings."""
        self.bindings[path] = found

    def knows(self, link: DraftWire) -> bool:
        """Say whether the producer's variables are bound, of a sum those of the elements that are read."""
        port = self.nodes[link.wire.block].block.interface.outputs[link.wire.port]
        if not self.bindings[link.wire.block].open([port]):
            return True
        return port.signal.is_sum and not any(unit.variables for unit in self._of(link))

    def take(self, link: DraftWire) -> bool:
        """Match the units of the elements."""
        draft, units = link.draft, self._of(link)
        bindings = self.bindings[draft.path]
        wrong = bindings.match(link.declared.units, units)
        if wrong is None:
            return True
        wanted = bindings.unit(link.declared.units, wrong)
        self.ratios[link.connection.place] = units[wrong] / wanted
        if _of_time(units[wrong]) and _of_time(wanted) and self._is_integral(link):
            self.integrals.add(link.connection.place)
        element = f"[{wrong}]" if len(units) > 1 else ""
        found = f"'{link.wire.source}' has {words(units[wrong])}"
        problem = f"input '{link.port}{element}' takes {words(wanted)}, {found}"
        self.fault(draft.path, link.connection.place, problem, "wire a signal of that unit")
        return False

    def _is_integral(self, link: DraftWire) -> bool:
        """Say whether a wire comes from a block whose output is in another unit times s."""
        (unit, *_) = self.nodes[link.wire.block].block.interface.outputs[link.wire.port].units
        return bool(unit.variables) and any(name == "s" and power > 0 for name, power in unit.dimension)

    def _given(self, path: str) -> Iterator[tuple[str, Declared, OpenUnits]]:
        """Yield the parameters and constants that are given, with the units in which they were written."""
        draft = self.drafts[path]
        interface = draft.interface
        for name, units in draft.units.items():
            yield name, interface.params[name], self._tried(path, name, units)
        for name, connection in draft.connections.items():
            if (
                isinstance(connection.source, Constant)
                and connection.units
                and (path, name) not in self.unknown
            ):
                yield name, interface.inputs[name], self._tried(path, name, connection.units)

    def _tried(self, path: str, name: str, units: OpenUnits) -> OpenUnits:
        factor = self.changed.get((path, name))
        if factor is None:
            return units
        return tuple(unit * factor if isinstance(unit, Unit) else unit for unit in units)

    def prepare(self, path: str) -> bool:
        """Let given values with a unit bind variables."""
        fresh = path not in self._prepared and any(
            isinstance(unit, Unit) for _, _, units in self._given(path) for unit in units
        )
        self._prepared.add(path)
        if fresh:
            self._match_given(path)
        return fresh

    def settle(self, path: str) -> None:
        """Let given values bind variables that wires leave open; others then count as plain numbers."""
        bindings, interface = self.bindings[path], self.drafts[path].interface
        self._match_given(path)
        undecided = [interface.inputs[port] for port in self.undecided(path)]
        if bindings.open(undecided) or self.drafts[path].block is UNKNOWN:
            return
        self._match_bare(path)
        bindings.spread(interface.outputs.values())
        for variable in bindings.open(interface.inputs.values()):
            bindings.bind(variable, ONE)
            self._match_given(path)
            self._match_bare(path)
        for param in interface.params.values():
            if len(bindings.open([param])) == 1:
                bindings.match(param.units, (ONE,))
        for variable in bindings.open(interface.outputs.values()):
            bindings.bind(variable, ONE)
        for name, declared, units in self._given(path):
            wrong = bindings.refuses(declared.units, units)
            if wrong is not None:
                self._report_given(path, name, declared, wrong, None)

    def _match_given(self, path: str) -> None:
        """Let given values bind variables: one may tell what another one, read before it, needs to know."""
        bindings, given, bound = self.bindings[path], list(self._given(path)), -1
        while bound < bindings.count:
            bound = bindings.count
            for name, declared, units in given:
                wrong = bindings.match(declared.units, units)
                if wrong is not None:
                    unit = units[wrong]
                    self._report_given(path, name, declared, wrong, unit if isinstance(unit, Unit) else None)
            if len(given) == 1:
                return

    def _match_bare(self, path: str) -> None:
        """Let numbers without unit bind open variables, first numbers whose unit is a variable itself."""
        outputs = {unit for port in self.drafts[path].interface.outputs.values() for unit in port.units}
        given = sorted(self._given(path), key=lambda item: (not variable_of(item[1].units[0]), item[0]))
        for _, declared, units in given:
            self.bindings[path].match_bare(declared.units, units, outputs)

    def _report_given(self, path: str, name: str, declared: Declared, index: int, unit: Unit | None) -> None:
        draft = self.drafts[path]
        wanted = self.bindings[path].unit(declared.units, index)
        place = draft.connections[name].place if name in draft.connections else draft.places[name]
        if unit is not None:
            self.given_ratios[place] = unit / wanted
        fitting = str(wanted.reduced) if wanted.exponents else "none"
        problem = f"'{name}' has {words(unit or ONE)}, its unit here is {fitting}"
        remedy = f"write it in {fitting}" if wanted.exponents else "leave the unit out"
        self.fault(path, place, problem, remedy)

    def knowledge(self, path: str) -> int:
        """Prefer a block whose given values bind something, then one of which nothing can be known.

        Then one with a number without unit, which is taken for a plain one if nothing else is known.
        """
        units = {type(unit) for _, _, units in self._given(path) for unit in units}
        if Unit in units and path not in self._prepared:
            return 3
        if self.undecided(path):
            return 2
        return int(Bare in units)


def words(unit: Unit) -> str:
    """Return a unit as a message shows it."""
    return str(unit.reduced) if unit.exponents else "no unit"


def _of_time(unit: Unit) -> bool:
    """Say whether a unit is that of a plain number, or a power of s."""
    return all(name == "s" for name, _ in unit.dimension)
