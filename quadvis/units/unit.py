"""Physical units of ports and parameters: comparing, combining, naming and unifying them.

A unit is a product of powers: of primes and pi for its scale to SI, of the dimensions m, kg, s, rad, px, A,
K, and of the unit variables a, b, c, a_0, a_1, and so on. So scales are exact and never rounded. Angles have
their own dimension, so that Hz and rad/s differ.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache

from quadvis.errors import quoted
from quadvis.units.grammar import LONGEST, UnitError, plain_spelling, read_powers
from quadvis.units.names import (
    BASES,
    DERIVED,
    NUMBERED,
    PREFIXED,
    PREFIXES,
    PRIMES,
    SCALES,
    VARIABLES,
)
from quadvis.units.spelling import elsewhere, spellings

_LARGEST_POWER = 60


def _powers(items: Iterable[tuple[str, Fraction]]) -> tuple[tuple[str, Fraction], ...]:
    """Return the sum of the exponents of each symbol, in the order of first occurrence."""
    total: dict[str, Fraction] = {}
    for symbol, exponent in items:
        total[symbol] = total[symbol] + exponent if symbol in total else exponent
    if any(abs(power.numerator) > _LARGEST_POWER * power.denominator for power in total.values()):
        raise UnitError(f"a unit has an exponent beyond {_LARGEST_POWER}")
    return tuple([(symbol, power) for symbol, power in total.items() if power.numerator])


@dataclass(frozen=True)
class Unit:
    """A unit; it equals every unit with the same dimensions and scale, such as Hz and 1/s."""

    exponents: frozenset[tuple[str, Fraction]] = frozenset()
    symbols: tuple[tuple[str, Fraction], ...] = field(default=(), compare=False, repr=False)

    @staticmethod
    def parse(text: str, *wanted: Unit) -> Unit:
        """Return the unit written as "rad/s^2", "N*m", "1/s", "deg/s", "%", "Hz^0.5", "W/(m*K)" or "1".

        UnitError if the text is no unit; its suggestion has the dimension of a ``wanted`` unit.
        """
        try:
            return _parse(text)
        except UnitError as error:
            raise advised(error, text, wanted) from None

    def __str__(self) -> str:
        """Return the unit as it was written, in one spelling; `Unit.parse` reads it back."""
        above = "*".join(_power(symbol, exponent) for symbol, exponent in self.symbols if exponent > 0)
        below = "".join(f"/{_power(symbol, -exponent)}" for symbol, exponent in self.symbols if exponent < 0)
        return (above or "1") + below

    def __mul__(self, other: Unit) -> Unit:
        """Return the unit of a product."""
        return _unit((*self.exponents, *other.exponents), (*self.symbols, *other.symbols))

    def __truediv__(self, other: Unit) -> Unit:
        """Return the unit of a quotient."""
        return self * other**-1

    def __pow__(self, exponent: Fraction | int) -> Unit:
        """Return the unit of a power, roots included."""
        return _unit(
            ((symbol, power * exponent) for symbol, power in self.exponents),
            ((symbol, power * exponent) for symbol, power in self.symbols),
        )

    @cached_property
    def scale(self) -> float:
        """The value of this unit in SI units: 0.001 for ms."""
        ratio, rest = self.exact_scale
        return float(ratio) * rest

    @cached_property
    def exact_scale(self) -> tuple[Fraction, float]:
        """The scale as an exact ratio and an irrational factor (pi, roots)."""
        ratio, rest = Fraction(1), 1.0
        for symbol, exponent in sorted(self.exponents):  # sets are ordered differently in each process
            if symbol in PRIMES and exponent.denominator == 1:
                ratio *= Fraction(PRIMES[symbol]) ** int(exponent)
            elif symbol in SCALES:
                rest *= float(PRIMES.get(symbol, math.pi)) ** float(exponent)
        return ratio, rest

    @cached_property
    def dimension(self) -> frozenset[tuple[str, Fraction]]:
        """The powers of the dimensions and variables, without the scale."""
        return frozenset((symbol, exponent) for symbol, exponent in self.exponents if symbol not in SCALES)

    @cached_property
    def variables(self) -> frozenset[str]:
        """The unit variables in this unit."""
        return frozenset(symbol for symbol, _ in self.exponents if symbol in VARIABLES or NUMBERED in symbol)

    def dimension_equals(self, other: Unit) -> bool:
        """Return whether a quantity can be converted from one unit to the other, such as m and mm."""
        return self.dimension == other.dimension

    @property
    def is_angle(self) -> bool:
        """Whether it is a power of rad, such as what rad/s has more than 1/s."""
        return bool(self.dimension) and all(name == "rad" for name, _ in self.dimension)

    @cached_property
    def reduced(self) -> Unit:
        """The same unit with fewer names, if a shorter product exists: s*N/kg/m is 1/s."""
        return _reduced(self.exponents, self.symbols)

    @cached_property
    def si(self) -> Unit:
        """The SI unit of the same dimension: rad/s of deg/s, V of mV."""
        return _in_bases(Unit(self.dimension)).reduced

    def substitute(self, bindings: Mapping[str, Unit]) -> Unit:
        """Return the unit with all bound variables replaced."""
        result = _unit(
            (item for item in self.exponents if item[0] not in bindings),
            (item for item in self.symbols if item[0] not in bindings),
        )
        for symbol, exponent in sorted(self.exponents):
            if symbol in bindings:
                result *= bindings[symbol] ** exponent
        return result


def _unit(exponents: Iterable[tuple[str, Fraction]], symbols: Iterable[tuple[str, Fraction]]) -> Unit:
    return Unit(frozenset(_powers(exponents)), _powers(symbols))


# Names for products of dimensions, the best known first.
_ORDER = (*VARIABLES, "kg", "m", "A", "K", "rad", "px", "s")
_SHORT = 3  # only a single name replaces a unit of up to so many factors: N*s/m stays, N/kg/m is 1/s^2
_NAMED = ("N", "W", "V", "ohm", "Pa", "T", "H", "F", "C")


@lru_cache(maxsize=4096)
def _reduced(exponents: frozenset[tuple[str, Fraction]], symbols: tuple[tuple[str, Fraction], ...]) -> Unit:
    """Return the shortest product of bases and a power of one name; the unit itself if it is as short."""
    unit = Unit(exponents, symbols)
    if unit.exponents != unit.dimension or len(symbols) < 2:
        return unit
    scale = math.lcm(*(power.denominator for _, power in exponents))  # whole numbers: fractions are slow
    powers = {base: int(power * scale) for base, power in exponents}
    name, _ = min(_named_powers(), key=lambda named: _length_beside(powers, scale, *named))
    best = name * _in_bases(unit / name)
    shorter = len(best.symbols) <= 1 if _length(unit) <= _SHORT else True
    return best if shorter and _length(best) < _length(unit) else _in_order(unit)


@lru_cache(maxsize=1)
def _named_powers() -> tuple[tuple[Unit, dict[str, int]], ...]:
    """Return 1 and powers of names, by which a unit may be divided, each with its powers of bases."""
    powers = (Unit(), *(name**power for name in map(Unit.parse, _NAMED) for power in (1, -1, 2, -2)))
    return tuple((unit, {base: int(power) for base, power in unit.exponents}) for unit in powers)


def _length_beside(powers: Mapping[str, int], scale: int, name: Unit, bases: Mapping[str, int]) -> int:
    """Return the length of a unit, given by powers of bases, when it is written as a name times bases.

    Powers and length are multiplied by ``scale``.
    """
    named = sum(abs(int(power)) for _, power in name.symbols)
    rest = (abs(powers.get(base, 0) - scale * bases.get(base, 0)) for base in {*powers, *bases})
    return scale * named + sum(rest)


def _in_bases(unit: Unit) -> Unit:
    return Unit(unit.exponents, tuple(sorted(unit.exponents, key=_place)))


def _in_order(unit: Unit) -> Unit:
    """Return the unit with its factors in the usual order: m*s, not s*m; names for products come first."""
    return Unit(unit.exponents, tuple(sorted(unit.symbols, key=_place)))


def _place(item: tuple[str, Fraction]) -> int:
    """Return the place of a factor in a product; names that are no bases come first."""
    return _ORDER.index(item[0]) if item[0] in _ORDER else -1


def _length(unit: Unit) -> Fraction:
    return sum((abs(exponent) for _, exponent in unit.symbols), Fraction(0))


def _power(symbol: str, exponent: Fraction) -> str:
    if exponent == 1:
        return symbol
    return f"{symbol}^{exponent}" if exponent.denominator == 1 else f"{symbol}^({exponent})"


def unify(pattern: Unit, actual: Unit, bindings: dict[str, Unit]) -> bool:
    """Return whether the units agree, and bind the variable of the pattern that the agreement determines.

    "a/s" against "m/s" binds a = m. Two unknown variables are not determined: the answer is True, the
    bindings stay, and the caller asks again when more is known. On False the bindings are unchanged.
    """
    try:
        wanted = pattern.substitute(bindings)
        if len(wanted.variables) != 1:
            return bool(wanted.variables) or wanted == actual
        (variable,) = wanted.variables
        exponent = dict(wanted.exponents)[variable]
        found = (actual / wanted.substitute({variable: Unit()})) ** (1 / exponent)
    except UnitError:
        return False
    bindings[variable] = found
    return True


@lru_cache(maxsize=1)
def _table() -> dict[str, Unit]:
    """Return every unit by its symbol."""
    one = Fraction(1)
    table = {name: Unit(frozenset({(name, one)}), ((name, one),)) for name in (*BASES, *SCALES)}
    for name, made_of in DERIVED.items():
        table[name] = Unit(_product(made_of, table).exponents, ((name, one),))
    for name in sorted(PREFIXED):
        power = Fraction(PREFIXES[name[0]])
        scaled = _unit((("2", power), ("5", power), *table[name[1:]].exponents), ((name, one),))
        table[name] = scaled
    for name in SCALES:
        del table[name]
    return table


@lru_cache(maxsize=1024)
def _parse(text: str) -> Unit:
    plain = plain_spelling(text)
    if not plain:
        raise UnitError("the unit is empty", "write '1' for a number without unit")
    if len(plain) > LONGEST:
        raise UnitError(f"{quoted(text)} is too long for a unit")
    if re.search(r"\s", plain):
        raise UnitError(f"{quoted(text)} holds a space", "write '*' for a product")
    return _product(plain, _table())


def _product(text: str, table: Mapping[str, Unit]) -> Unit:
    """Return the product of the powers that a text in plain spelling names."""
    powers = read_powers(text, table)
    parts = [
        (table[name].exponents if name in table else [(name, Fraction(1))], exponent)
        for name, exponent in powers
    ]
    return _unit(((base, power * exponent) for bases, exponent in parts for base, power in bases), powers)


def advised(error: UnitError, text: str, wanted: Sequence[Unit] = ()) -> UnitError:
    """Return the error with a suggestion, which has the dimension of a wanted unit if any is known."""
    plain = plain_spelling(text)
    name, why, remedy = elsewhere(plain) or ("", "", "")
    if name:
        return UnitError(f"{quoted(name)} is not a unit here{why}", remedy)
    table = _table()
    likely = [name for name, unit in table.items() if any(map(unit.dimension_equals, wanted))]
    tried = spellings(plain, table, likely) if len(plain) <= LONGEST else iter(())
    for near in tried:
        try:
            meant = _parse(near)
        except UnitError:
            continue
        if not wanted or any(map(meant.dimension_equals, wanted)):
            is_product = near == "*".join(plain.split()) != plain
            remedy = f"write {quoted(near)} for a product" if is_product else f"did you mean {quoted(near)}?"
            return UnitError(
                f"{quoted(text.strip())} {'holds a space' if is_product else 'is not a unit'}", remedy
            )
    if not wanted:
        return error
    return UnitError(error.problem, f"write it in {' or '.join(map(str, wanted))}")


@lru_cache(maxsize=1024)
def parse_units(text: str) -> tuple[Unit, ...]:
    """Return the units of a port's elements: one for all elements ("m/s"), or one each ("m m m rad")."""
    plain = plain_spelling(text).split()
    if not plain:
        raise UnitError("the unit is empty", "write '1' for a number without unit")
    return tuple(map(Unit.parse, plain))
