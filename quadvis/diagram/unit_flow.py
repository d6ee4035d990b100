"""How units flow along wires: unit variables of blocks are bound by what comes in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from quadvis.block import Declared, Param
from quadvis.diagram.flow import ONE, Flow, Link
from quadvis.diagram.values import OpenUnits
from quadvis.engine.graph import Constant, selected
from quadvis.units import Unit, unify


class Bindings:
    """What the unit variables of one block stand for, element by element of its vectors."""

    def __init__(self) -> None:
        self.elements: list[dict[str, Unit]] = [{}]

    def match(self, pattern: tuple[Unit, ...], units: OpenUnits) -> int | None:
        """Bind what the units of the elements say; return the first that does not fit, None if all do."""
        if len(pattern) == len(self.elements) == 1 and units.count(units[0]) == len(units):
            units = units[:1]  # what all say alike holds for every element, as the unit of a scalar does
        missing = len(units) - len(self.elements)
        self.elements += [dict(self.elements[0]) for _ in range(missing)]
        for index, unit in enumerate(units):
            # The unit of a scalar holds for every element of the block's vectors.
            places = self.elements if len(units) == 1 else self.elements[index : index + 1]
            wanted = pattern[index % len(pattern)]
            if (
                unit is not None
                and unit != wanted
                and not all([_unify(wanted, unit, bound) for bound in places])
            ):
                return index
        return None

    def unit(self, pattern: tuple[Unit, ...], index: int) -> Unit:
        """Return the unit of an element, with the variables that are bound replaced."""
        unit, bound = pattern[index % len(pattern)], self.elements[min(index, len(self.elements) - 1)]
        if not unit.variables:
            return unit
        return bound.get(_variable(unit)) or unit.substitute(bound)

    def open(self, declared: Iterable[Declared]) -> list[str]:
        """Return the variables of some ports and parameters that nothing has bound yet, in some element."""
        names = {name for item in declared for unit in item.units for name in unit.variables}
        return sorted(name for name in names if any(name not in bound for bound in self.elements))

    def spread(self) -> None:
        """Give elements that say nothing, such as a plain 0, the unit of the others if these agree."""
        for name in {name for bound in self.elements for name in bound}:
            units = {bound[name] for bound in self.elements if name in bound}
            if len(units) == 1:
                self.bind(name, units.pop())

    def bind(self, variable: str, unit: Unit) -> None:
        """Let a variable stand for a unit wherever it is open."""
        for bound in self.elements:
            bound.setdefault(variable, unit)


def _variable(unit: Unit) -> str:
    """Return the variable that the unit is, empty if it is more: a way round slow arithmetic with units."""
    names = [name for name, exponent in unit.exponents if exponent == 1 and name in unit.variables]
    return names[0] if len(unit.exponents) == 1 and names else ""


def _unify(wanted: Unit, unit: Unit, bound: dict[str, Unit]) -> bool:
    name = _variable(wanted)
    return (
        bound.setdefault(name, unit) == unit
        if name
        else bool(wanted.variables) and unify(wanted, unit, bound)
    )


class UnitFlow(Flow):
    """Units: binds the variables of every block, and fills in the units of every node."""

    def run(self) -> None:
        """Follow every wire, then note the units of all ports and parameters."""
        self.bindings = {path: Bindings() for path in self.drafts}
        super().run()
        for path, node in self.nodes.items():
            interface = node.block.interface
            params = interface.params.values() if self.drafts[path].whole else ()
            for declared in (*interface.outputs.values(), *params, *interface.inputs.values()):
                units = self._units(path, declared)
                if not any(unit.variables for unit in units):
                    node.units[declared.name] = units

    def _count(self, path: str, declared: Declared) -> int:
        if isinstance(declared, Param):
            return int(np.size(getattr(self.drafts[path].block, declared.name)))
        return math.prod(self.nodes[path].shape(declared.name))

    def _units(self, path: str, declared: Declared) -> tuple[Unit, ...]:
        count = self._count(path, declared)
        if len(declared.units) == len(self.bindings[path].elements) == 1:
            return (self.bindings[path].unit(declared.units, 0),) * count
        return tuple(self.bindings[path].unit(declared.units, index) for index in range(count))

    def _of(self, link: Link) -> tuple[Unit, ...]:
        wire = link.wire
        node = self.nodes[wire.block]
        units = self._units(wire.block, node.block.interface.outputs[wire.port])
        part = selected(node.shape(wire.port), wire.index)
        assert part is not None, "the shapes have been checked"
        return units[part[0] : part[0] + math.prod(part[1])]

    def knows(self, link: Link) -> bool:
        """Say whether the producer's variables are bound."""
        port = self.nodes[link.wire.block].block.interface.outputs[link.wire.port]
        return not self.bindings[link.wire.block].open([port])

    def take(self, link: Link) -> bool:
        """Match the units of the elements."""
        draft, units = link.draft, self._of(link)
        bindings = self.bindings[draft.path]
        wrong = bindings.match(link.declared.units, units)
        if wrong is None:
            return True
        wanted = bindings.unit(link.declared.units, wrong)
        element = f"[{wrong}]" if len(units) > 1 else ""
        found = f"'{link.wire.source}' has {words(units[wrong])}"
        problem = f"input '{link.port}{element}' takes {words(wanted)}, {found}"
        self.fault(draft.path, link.connection.place, problem, "wire a signal of that unit")
        return False

    def _given(self, path: str) -> Iterator[tuple[str, Declared, OpenUnits]]:
        """Yield the parameters and constants that are given, with the units in which they were written."""
        draft = self.drafts[path]
        interface = draft.block.interface
        for name, units in draft.units.items():
            yield name, interface.params[name], units
        for name, connection in draft.connections.items():
            if isinstance(connection.source, Constant) and connection.units and (path, name) not in self.lost:
                yield name, interface.inputs[name], connection.units

    def settle(self, path: str) -> None:
        """Let given values bind what wires do not; what is still open then counts as plain numbers."""
        bindings, interface = self.bindings[path], self.drafts[path].block.interface
        self._match_given(path)
        doubtful = [port for name, port in interface.inputs.items() if (path, name) in self.lost]
        if bindings.open(doubtful) or not self.drafts[path].whole:
            return
        bindings.spread()
        for variable in bindings.open(interface.inputs.values()):
            bindings.bind(variable, ONE)
            self._match_given(path)
        for param in interface.params.values():
            if len(bindings.open([param])) == 1:
                bindings.match(param.units, (ONE,))
        for variable in bindings.open(interface.outputs.values()):
            bindings.bind(variable, ONE)

    def _match_given(self, path: str) -> None:
        for name, declared, units in self._given(path):
            wrong = self.bindings[path].match(declared.units, units)
            if wrong is not None:
                self._tell_given(path, name, declared, wrong, units[wrong] or ONE)

    def _tell_given(self, path: str, name: str, declared: Declared, index: int, unit: Unit) -> None:
        draft = self.drafts[path]
        wanted = self.bindings[path].unit(declared.units, index)
        place = draft.connections[name].place if name in draft.connections else draft.places[name]
        problem = f"'{name}' has {words(unit)}, its unit here is {wanted if wanted.symbols else 'none'}"
        self.fault(path, place, problem, f"write it in {wanted}" if wanted.symbols else "leave the unit out")

    def knowledge(self, path: str) -> int:
        """Prefer a block whose given values bind something, then one of which nothing can be known."""
        if any(unit is not None for _, _, units in self._given(path) for unit in units):
            return 2
        return int(any((path, port) in self.lost for port in self.drafts[path].block.interface.inputs))


def words(unit: Unit) -> str:
    """Return a unit as a message shows it."""
    return str(unit) if unit.symbols else "no unit"
