"""Physical units of ports and parameters: reading, comparing, combining and unifying them.

A unit is a product of powers. Its scale to SI is kept exactly, as powers of 2, 3, 5 and pi, beside the powers
of the dimensions m, kg, s, rad, px, A, K and of the unit variables a, b, c; hence nothing is ever rounded.
Angles have a dimension of their own, so that Hz and rad/s are told apart.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache

from quadvis.errors import QuadvisError, quoted, sentence, suggestion

VARIABLES = ("a", "b", "c")
_PRIMES = {"2": 2, "3": 3, "5": 5}
_SCALES = frozenset((*_PRIMES, "pi"))
_LARGEST_POWER = 60
LONGEST = 80

_BASES = ("m", "kg", "s", "rad", "px", "A", "K", *VARIABLES)
# Every other unit by what it is made of; each line uses only names above it.
_DERIVED = {
    "%": "2^-2*5^-2", "Hz": "s^-1", "N": "kg*m/s^2", "J": "N*m", "W": "J/s", "V": "W/A", "ohm": "V/A",
    "Pa": "N/m^2", "T": "N/A/m", "min": "2^2*3*5*s", "h": "2^2*3*5*min", "deg": "pi*2^-2*3^-2*5^-1*rad",
    "rev": "2*pi*rad", "rpm": "rev/min",
}  # fmt: skip
_PREFIXES = {"n": -9, "u": -6, "m": -3, "c": -2, "h": 2, "k": 3, "M": 6}
# No gram: people write g for gravity.
_PREFIXED = "km cm mm um nm ms us ns mrad mA uA mV uV kV mN kN mW kW kHz MHz hPa kPa mT uT"
_SPELLINGS = str.maketrans(
    {"·": "*", "⋅": "*", "\u00d7": "*", "²": "^2", "³": "^3", "µ": "u", "μ": "u", "°": "deg"}
)
_WORDS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "usec": "us", "millisecond": "ms",
    "milliseconds": "ms", "hr": "h", "hour": "h", "hours": "h", "minute": "min", "minutes": "min",
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "hertz": "Hz", "fps": "Hz", "degree": "deg",
    "degrees": "deg", "radian": "rad", "radians": "rad", "pixel": "px", "pixels": "px", "volt": "V",
    "volts": "V", "amp": "A", "amps": "A", "ampere": "A", "newton": "N", "newtons": "N", "watt": "W",
    "watts": "W", "percent": "%", "rps": "rev/s", "mps": "m/s", "kph": "km/h", "kmh": "km/h",
}  # fmt: skip

_TOKEN = re.compile(r"([A-Za-z%]+)|([0-9]+(?:\.[0-9]+)?)|([*/^()-])")
_AROUND_OPERATOR = re.compile(r"\s*([*/^])\s*")


class UnitError(QuadvisError):
    """A text that is not a unit or not a quantity: the problem, and what would be right."""

    def __init__(self, problem: str, remedy: str = "") -> None:
        """Keep both halves of the sentence apart, for messages that name a place."""
        self.problem, self.remedy = problem, remedy
        super().__init__(sentence(problem, remedy))


def _powers(items: Iterable[tuple[str, Fraction]]) -> tuple[tuple[str, Fraction], ...]:
    """Return the sum of the exponents of each symbol, in the order of first mention."""
    total: dict[str, Fraction] = {}
    for symbol, exponent in items:
        total[symbol] = total.get(symbol, Fraction(0)) + exponent
    if any(abs(exponent) > _LARGEST_POWER for exponent in total.values()):
        raise UnitError(f"a unit has an exponent beyond {_LARGEST_POWER}")
    return tuple((symbol, exponent) for symbol, exponent in total.items() if exponent)


@dataclass(frozen=True)
class Unit:
    """A unit; equal to every other with the same dimensions and scale (Hz and 1/s), however written."""

    exponents: frozenset[tuple[str, Fraction]] = frozenset()
    symbols: tuple[tuple[str, Fraction], ...] = field(default=(), compare=False, repr=False)

    @staticmethod
    def parse(text: str) -> Unit:
        """Return the unit written as "rad/s^2", "N*m", "1/s", "deg/s", "%", "Hz^0.5", "W/(m*K)" or "1"."""
        return _parse(text)

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
        """The scale as an exact ratio, and the irrational rest (pi, roots)."""
        ratio, rest = Fraction(1), 1.0
        for symbol, exponent in sorted(self.exponents):  # sets differ in order from one process to the next
            if symbol in _PRIMES and exponent.denominator == 1:
                ratio *= Fraction(_PRIMES[symbol]) ** int(exponent)
            elif symbol in _SCALES:
                rest *= float(_PRIMES.get(symbol, math.pi)) ** float(exponent)
        return ratio, rest

    @cached_property
    def dimension(self) -> frozenset[tuple[str, Fraction]]:
        """The powers of the dimensions and variables, without the scale."""
        return frozenset((symbol, exponent) for symbol, exponent in self.exponents if symbol not in _SCALES)

    @cached_property
    def variables(self) -> frozenset[str]:
        """The unit variables that it holds."""
        return frozenset(symbol for symbol, _ in self.exponents if symbol in VARIABLES)

    def dimension_equals(self, other: Unit) -> bool:
        """Say whether a quantity in one unit can be converted into the other: m and mm."""
        return self.dimension == other.dimension

    def substitute(self, bindings: Mapping[str, Unit]) -> Unit:
        """Return the unit with the variables replaced that are bound."""
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


def _power(symbol: str, exponent: Fraction) -> str:
    if exponent == 1:
        return symbol
    return f"{symbol}^{exponent}" if exponent.denominator == 1 else f"{symbol}^({exponent})"


def unify(pattern: Unit, actual: Unit, bindings: dict[str, Unit]) -> bool:
    """Say whether the units agree, and bind the variable of the pattern that this settles.

    "a/s" against "m/s" binds a = m. With two unknown variables nothing is settled: the answer is True, the
    bindings stay, and the caller asks again when others are known. On False the bindings are as before.
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
    table = {name: Unit(frozenset({(name, one)}), ((name, one),)) for name in (*_BASES, *_SCALES)}
    for name, made_of in _DERIVED.items():
        table[name] = Unit(_Reader(made_of, table).unit().exponents, ((name, one),))
    for name in _PREFIXED.split():
        power = Fraction(_PREFIXES[name[0]])
        scaled = _unit((("2", power), ("5", power), *table[name[1:]].exponents), ((name, one),))
        table[name] = scaled
    for name in _SCALES:
        del table[name]
    return table


@lru_cache(maxsize=1024)
def _parse(text: str) -> Unit:
    plain = _AROUND_OPERATOR.sub(r"\1", text.translate(_SPELLINGS)).strip()
    if not plain:
        raise UnitError("the unit is empty", "write '1' for a number without unit")
    if len(plain) > LONGEST:
        raise UnitError(f"{quoted(text)} is too long for a unit")
    if re.search(r"\s", plain):
        product = quoted("*".join(plain.split()))
        raise UnitError(f"{quoted(text)} holds a space", f"write {product} for a product")
    return _Reader(plain, _table()).unit()


class _Reader:
    """Reads one unit: factors joined by `*` and `/`, left to right, each with an optional `^` power."""

    def __init__(self, text: str, table: Mapping[str, Unit]) -> None:
        self.text, self.table = text, table
        self.tokens = self._split()
        self.at = 0

    def _split(self) -> list[str]:
        tokens, position = [], 0
        while position < len(self.text):
            match = _TOKEN.match(self.text, position)
            if match is None:
                wrong = quoted(self.text[position])
                raise UnitError(f"{quoted(self.text)} is not a unit", f"{wrong} is no part of one")
            tokens.append(match.group())
            position = match.end()
        return tokens

    def _next(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def _take(self) -> str:
        token = self._next()
        self.at += 1
        return token

    def unit(self) -> Unit:
        result = self._product()
        if self._next():
            raise self._fault(self.at)
        return result

    def _product(self) -> Unit:
        result = self._factor()
        while self._next() in ("*", "/"):
            result = result * self._factor() if self._take() == "*" else result / self._factor()
        return result

    def _factor(self) -> Unit:
        token = self._take()
        if token == "(":
            result = self._product()
            if self._take() != ")":
                raise UnitError(f"{quoted(self.text)} lacks a ')'")
        elif token == "1":
            result = Unit()
        elif token in self.table:
            result = self.table[token]
        else:
            raise self._fault(self.at - 1)
        if self._next() == "^":
            self.at += 1
            result **= self._exponent()
        return result

    def _exponent(self) -> Fraction:
        if self._next() != "(":
            return self._signed()
        self.at += 1
        result = self._signed()
        if self._next() == "/":
            self.at += 1
            below = self._signed()
            if not below:
                raise UnitError(f"{quoted(self.text)} divides by zero")
            result /= below
        if self._take() != ")":
            raise UnitError(f"{quoted(self.text)} lacks a ')'")
        return result

    def _signed(self) -> Fraction:
        sign = -1 if self._next() == "-" else 1
        self.at += sign < 0
        token = self._take()
        if not token[:1].isdigit() or len(token) > 5:
            raise UnitError(f"{quoted(self.text)} has no exponent after '^'", "write such as 's^2' or 's^-1'")
        return sign * Fraction(token)

    def _fault(self, position: int) -> UnitError:
        token = self.tokens[position] if position < len(self.tokens) else ""
        if token in ("", *"*/^()-"):
            missing = "a unit is missing at its end" if not token else f"'{token}' stands where it cannot"
            return UnitError(f"{quoted(self.text)} is not a unit", missing)
        if token == "g":
            return UnitError("'g' is not a unit, since gram and gravity share it", "write 'kg' or 'm/s^2'")
        if token[0].isdigit() or token.isdigit():
            before = self.tokens[position - 1] if position else ""
            power = f"did you mean '{before}^{token}'?" if before in self.table else ""
            return UnitError(f"{quoted(self.text)} is not a unit", power or f"leave out the number {token}")
        word = _WORDS.get(token.lower())
        remedy = f"did you mean '{word}'?" if word else suggestion(token, self.table)
        return UnitError(f"{quoted(token)} is not a unit", remedy or "use m, s, rad, kg, N, V, Hz, px ...")


def parse_units(text: str) -> tuple[Unit, ...]:
    """Return the units of a port's elements: one for all of them ("m/s"), or one each ("m m m rad")."""
    plain = _AROUND_OPERATOR.sub(r"\1", text.translate(_SPELLINGS)).split()
    if not plain:
        raise UnitError("the unit is empty", "write '1' for a number without unit")
    return tuple(map(_parse, plain))
