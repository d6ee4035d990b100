"""The bindings of unit variables."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from quadvis.block import Declared
from quadvis.diagram.values import Bare, OpenUnits
from quadvis.units import Unit, unify

ONE = Unit()


class Bindings:
    """The bindings of the unit variables of one block, element by element of its vectors."""

    def __init__(self) -> None:
        self.elements: list[dict[str, Unit]] = [{}]
        self._known: dict[tuple[Declared, int, tuple[int, ...]], tuple[Unit, ...]] = {}

    def match(self, pattern: tuple[Unit, ...], units: OpenUnits) -> int | None:
        """Bind variables by the units of the elements; return the first unit that does not fit, or None."""
        for index, wanted, unit, places in self._pairs(pattern, units):
            if (
                isinstance(unit, Unit)
                and unit != wanted
                and not all([_unify(wanted, unit, bound) for bound in places])
            ):
                return index
        return None

    def match_bare(self, pattern: tuple[Unit, ...], units: OpenUnits, outputs: Collection[Unit]) -> None:
        """Let numbers without unit bind open variables.

        One that stands for an output makes the output a plain number, any other the variable: 3 in "a/s" is
        3 1/s.
        """
        for _, wanted, unit, places in self._pairs(pattern, units):
            if isinstance(unit, Bare):
                plain = ONE if wanted in outputs else _plain(wanted)
                for bound in places:
                    unify(wanted, plain, bound)

    def refuses(self, pattern: tuple[Unit, ...], units: OpenUnits) -> int | None:
        """Return the first number that lacks a unit, or None."""
        for index, wanted, unit, places in self._pairs(pattern, units):
            if isinstance(unit, Bare):
                found = {wanted.substitute(bound) for bound in places}
                if not found <= {ONE, _plain(wanted)} and not any(each.variables for each in found):
                    return index
        return None

    def _pairs(
        self, pattern: tuple[Unit, ...], units: OpenUnits
    ) -> Iterator[tuple[int, Unit, Unit | Bare | None, list[dict[str, Unit]]]]:
        """Yield the elements: index, declared unit, given unit, and the bindings of the variables there."""
        if len(pattern) == len(self.elements) == 1 and units.count(units[0]) == len(units):
            units = units[:1]  # what all say alike holds for every element, as the unit of a scalar does
        missing = len(units) - len(self.elements)
        self.elements += [dict(self.elements[0]) for _ in range(missing)]
        for index, unit in enumerate(units):
            # The unit of a scalar holds for every element of the block's vectors.
            places = self.elements if len(units) == 1 else self.elements[index : index + 1]
            yield index, pattern[index % len(pattern)], unit, places

    def unit(self, pattern: tuple[Unit, ...], index: int) -> Unit:
        """Return the unit of an element, with the variables that are bound replaced."""
        unit, bound = pattern[index % len(pattern)], self.elements[min(index, len(self.elements) - 1)]
        if not unit.variables:
            return unit
        return bound.get(variable_of(unit)) or unit.substitute(bound)

    def units(self, declared: Declared, count: int, parts: tuple[int, ...] = ()) -> tuple[Unit, ...]:
        """Return the units of the elements of a port or parameter; of one that has ``parts`` part by part."""
        found = self._known.get((declared, count, parts))
        if found is None:
            if len(parts) == len(declared.units) > 1:
                pairs = zip(declared.units, parts, strict=True)
                found = tuple([self.unit((unit,), index) for unit, size in pairs for index in range(size)])
            elif len(declared.units) == len(self.elements) == 1:
                found = (self.unit(declared.units, 0),) * count
            else:
                found = tuple([self.unit(declared.units, index) for index in range(count)])
            if not any(unit.variables for unit in found):
                self._known[declared, count, parts] = found  # what is bound stays so
        return found

    @property
    def count(self) -> int:
        """The number of variables that are bound, in all elements."""
        return sum(map(len, self.elements))

    def open(self, declared: Iterable[Declared]) -> list[str]:
        """Return the variables of some ports and parameters that nothing has bound yet, in some element."""
        names = {name for item in declared for unit in item.units for name in unit.variables}
        return sorted(name for name in names if any(name not in bound for bound in self.elements))

    def spread(self, outputs: Iterable[Declared] = ()) -> None:
        """Give elements that say nothing, such as a plain 0, the unit of the others if these agree.

        The parts of an output whose size is a sum are elements of one vector, too.
        """
        vectors = [{name} for name in sorted({name for bound in self.elements for name in bound})]
        sums = [port for port in outputs if port.signal.is_sum]
        vectors += [{name for unit in port.units for name in unit.variables} for port in sums]
        for vector in vectors:
            units = {bound[name] for bound in self.elements for name in vector if name in bound}
            if len(units) == 1:
                for name in vector:
                    self.bind(name, *units)

    def bind(self, variable: str, unit: Unit) -> None:
        """Let a variable stand for a unit wherever it is open."""
        for bound in self.elements:
            bound.setdefault(variable, unit)


def _plain(unit: Unit) -> Unit:
    """Return a declared unit with plain numbers in place of its variables: 1/s for "a/s"."""
    return unit.substitute(dict.fromkeys(unit.variables, ONE)) if unit.variables else unit


def variable_of(unit: Unit) -> str:
    """Return the variable that the unit is, empty if it is more: a way round slow arithmetic with units."""
    names = [name for name, exponent in unit.exponents if exponent == 1 and name in unit.variables]
    return names[0] if len(unit.exponents) == 1 and names else ""


def _unify(wanted: Unit, unit: Unit, bound: dict[str, Unit]) -> bool:
    name = variable_of(wanted)
    return (
        bound.setdefault(name, unit) == unit
        if name
        else bool(wanted.variables) and unify(wanted, unit, bound)
    )
