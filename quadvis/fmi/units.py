"""Units of FMUs as units of quadvis, with how a value goes from the one to the other.

An FMU says of a unit by which factor and offset, and in which powers of SI units, a value of it stands for a
quantity. Names alone are trusted only where the FMU says no more; where it says something else than the name
does, it is refused, since many a factor was written upside down.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from quadvis.errors import QuadvisError, quoted
from quadvis.fmi.description import FmuUnit, FmuVariable
from quadvis.units import Unit, UnitError, parse_quantity

CELSIUS, FAHRENHEIT = ("degC", "Celsius", "°C"), ("degF", "Fahrenheit", "°F")
NEAR = (
    1e-5  # relative difference of a factor from that of the name: 1 deg is 0.01745329 rad to so many digits
)
_POWER = re.compile(r"([A-Za-z%])([+-]?[0-9]+)")


@dataclass(frozen=True)
class Conversion:
    """A quantity in ``unit``, of SI, is ``factor * value + offset`` of a value of the FMU."""

    unit: Unit
    factor: float = 1.0
    offset: float = 0.0

    @property
    def same(self) -> bool:
        """Whether both have the same number."""
        return self.factor == 1.0 and self.offset == 0.0

    def to_si(self, value: float) -> float:
        """Return the quantity in SI units."""
        return self.factor * value + self.offset

    def from_si(self, value: float) -> float:
        """Return the value of the FMU."""
        return (value - self.offset) / self.factor


class Units:
    """The units of an FMU. ``confirmed`` is what the user says: "furlong = 201.168 m, h = m".

    A name there is that of a unit, or of a variable. QuadvisError for a text of another form.
    """

    def __init__(self, known: Mapping[str, FmuUnit], confirmed: str = "") -> None:
        self._known = known
        self.confirmed = dict(map(_confirmation, filter(None, map(str.strip, confirmed.split(",")))))

    def of(self, variable: FmuVariable) -> Conversion:
        """Return the conversion of a variable's values; QuadvisError for a unit that is not known."""
        for name in (variable.name, variable.unit):
            if name and name in self.confirmed:
                return _relative(self.confirmed[name], variable)
        if not variable.unit:
            return Conversion(Unit())
        return _relative(self._read(variable), variable)

    def _read(self, variable: FmuVariable) -> Conversion:
        unit = self._known.get(variable.unit, FmuUnit(variable.unit))
        by_name = named(unit.name)
        if unit.exponents is None:
            if by_name is None:
                raise QuadvisError(
                    f"variable {quoted(variable.name)} has the unit {quoted(unit.name)}, which is not known; "
                    f"say what it is, as in units: '{unit.name} = 1 m'"
                )
            return by_name
        stated = _stated(unit, variable)
        if by_name is None:
            return stated
        if not _agree(stated, by_name):
            raise QuadvisError(
                f"the FMU says that 1 {unit.name} is {_words(stated)}, but it is {_words(by_name)}; "
                f"say what is right, as in units: '{unit.name} = {_words(by_name)}'"
            )
        return by_name


def named(name: str) -> Conversion | None:
    """Return what a name of a unit means by itself, in quadvis's spelling or Modelica's; None if nothing."""
    if name in CELSIUS:
        return Conversion(Unit.parse("K"), 1.0, 273.15)
    if name in FAHRENHEIT:
        return Conversion(Unit.parse("K"), 5 / 9, 459.67 * 5 / 9)
    for text in (name, _POWER.sub(r"\1^\2", name.replace(".", "*"))):
        try:
            unit = Unit.parse(text)
        except UnitError:
            continue
        if not unit.variables:
            return Conversion(_si(unit), unit.scale)
    return None


def _si(unit: Unit) -> Unit:
    return Unit(unit.dimension, tuple(sorted(unit.dimension))).reduced


def _stated(unit: FmuUnit, variable: FmuVariable) -> Conversion:
    """Return what the FMU says of a unit."""
    assert unit.exponents is not None
    foreign = sorted(unit.exponents.keys() & {"mol", "cd"})
    if foreign:
        raise QuadvisError(
            f"variable {quoted(variable.name)} has the unit {quoted(unit.name)}, which contains "
            f"{foreign[0]}; say as what it counts, as in units: '{unit.name} = 1'"
        )
    text = "*".join(f"{name}^{power}" for name, power in unit.exponents.items())
    return Conversion(Unit.parse(text).reduced if text else Unit(), unit.factor, unit.offset)


def _agree(one: Conversion, other: Conversion) -> bool:
    """Return whether two conversions mean the same; an FMU may leave rad out."""
    plain = [
        {(symbol, power) for symbol, power in each.unit.dimension if symbol != "rad"} for each in (one, other)
    ]
    return (
        plain[0] == plain[1]
        and math.isclose(one.factor, other.factor, rel_tol=NEAR)
        and math.isclose(one.offset, other.offset, rel_tol=NEAR)
    )


def _words(conversion: Conversion) -> str:
    unit = f" {conversion.unit}" if conversion.unit.exponents else ""
    offset = f" + {conversion.offset:g}{unit}" if conversion.offset else ""
    return f"{conversion.factor:g}{unit}{offset}"


def _relative(conversion: Conversion, variable: FmuVariable) -> Conversion:
    """Return the conversion of a variable: a difference has no offset."""
    return Conversion(conversion.unit, conversion.factor) if variable.relative else conversion


def _confirmation(text: str) -> tuple[str, Conversion]:
    """Return a name and what it means, from "name = 2 m", "name = m" or "name = degC"."""
    name, equals, meaning = (part.strip() for part in text.rpartition("="))
    if not (name and equals and meaning):
        raise QuadvisError(
            f"{quoted(text)} does not say what a unit is; write it as in 'furlong = 201.168 m'"
        )
    if (found := named(meaning)) is not None:
        return name, found
    try:
        value, unit = parse_quantity(meaning)
    except UnitError as error:
        raise QuadvisError(f"{quoted(text)}: {error}") from None
    if value == 0.0 or unit.variables:
        raise QuadvisError(f"{quoted(text)} does not say what a unit is")
    return name, Conversion(_si(unit), value)
