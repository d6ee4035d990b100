"""The value of an expression of numbers with units, exact as long as its functions and units allow it.

Numbers are fractions until a function such as sin, or a root, makes them floats; multiples of pi stay exact,
so "pi rad" is 180 deg. Products have the product of the units; sums, comparisons, min and max take operands
of one dimension, or 0; sin takes an angle, and asin gives one. Lists count element by element.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from quadvis.errors import quoted
from quadvis.units.expression import Number, Symbol, Tree, parse_expression
from quadvis.units.grammar import LONGEST, UnitError
from quadvis.units.unit import Unit

ONE, RADIAN = Unit(), Unit.parse("rad")
_MOST_BITS, _MOST_POWER = 2048, 300  # of a fraction, before it becomes a float; of a whole exponent


class Value(NamedTuple):
    """A number, exact if it is a fraction, in a unit."""

    number: Fraction | float
    unit: Unit = ONE

    @property
    def is_zero(self) -> bool:
        """Whether it is a 0 without unit, which fits any."""
        return self.number == 0 and not self.unit.dimension

    @property
    def si(self) -> Value:
        """The same in the SI unit of its dimension."""
        ratio, rest = self.unit.exact_scale
        if rest != 1.0:
            return Value(float(self.number * ratio) * rest, self.unit.si)
        return Value(self.number * ratio, self.unit.si)

    @property
    def text(self) -> str:
        """The value as a quantity in its SI unit, which reads back as the same number."""
        number, unit = self.si
        return f"{_number_text(number)} {unit}" if unit.symbols else _number_text(number)


Values = Value | list[Any]  # lists of values of any depth
Lookup = Callable[[str], Values]


def evaluate(tree: Tree, lookup: Lookup) -> Values:
    """Return the value of a tree; ``lookup`` gives those of names. UnitError says what is wrong."""
    if isinstance(tree, Number):
        return Value(tree.value, tree.unit)
    if isinstance(tree, Symbol):
        return lookup(tree.text)
    arguments = [evaluate(argument, lookup) for argument in tree.arguments]
    try:
        return _each(tree.function, arguments)
    except OverflowError:
        raise UnitError(f"{quoted(tree.function)} leaves the range of numbers") from None


@lru_cache(maxsize=4096)
def arithmetic(text: str) -> Value:
    """Return the value of a text without parameters, such as "2 pi rad/s"."""
    found = evaluate(parse_expression(text), _no_names)
    assert isinstance(found, Value)
    return found


def _no_names(name: str) -> Values:
    raise UnitError(f"{quoted(name)} stands where a value must", "write the value itself")


def _each(function: str, arguments: Sequence[Values]) -> Values:
    """Return the value of a function, element by element where an argument is a list."""
    lists = [argument for argument in arguments if isinstance(argument, list)]
    if not lists:
        return _finite(function, _apply(function, [each for each in arguments if isinstance(each, Value)]))
    count = len(lists[0])
    if any(len(other) != count for other in lists):
        raise UnitError(
            f"'{function}' joins lists of {count} and {len(lists[-1])} elements", "give lists of one length"
        )
    return [
        _each(function, [each[index] if isinstance(each, list) else each for each in arguments])
        for index in range(count)
    ]


def _finite(function: str, value: Value) -> Value:
    number = value.number
    if isinstance(number, Fraction):
        if max(number.numerator.bit_length(), number.denominator.bit_length()) > _MOST_BITS:
            return Value(float(number), value.unit)
    elif not math.isfinite(number):
        raise UnitError(f"'{function}' gives {'no number' if math.isnan(number) else 'infinity'}")
    return value


def _apply(function: str, values: Sequence[Value]) -> Value:
    if function in _SUMS:
        return _SUMS[function](*values)
    if function in _COMMON:
        return _common(function, values)
    if function in _PLAIN:
        return _plain(function, values[0])
    raise UnitError(f"{quoted(function)} is for signals", "leave it out of the value of a parameter")


def _add(one: Value, other: Value, sign: int = 1) -> Value:
    one, other = _alike("+" if sign > 0 else "-", one, other)
    return Value(one.number + sign * other.number, one.unit)


def _multiply(one: Value, other: Value) -> Value:
    return Value(one.number * other.number, one.unit * other.unit)


def _divide(one: Value, other: Value) -> Value:
    if other.number == 0:
        raise UnitError("there is a division by zero", "divide by another value")
    return Value(one.number / other.number, one.unit / other.unit)


def _power(base: Value, exponent: Value) -> Value:
    ratio = _unit_free("^", exponent).number
    exact = ratio if isinstance(ratio, Fraction) else Fraction(ratio).limit_denominator(1000)
    if base.unit.exponents and not isinstance(ratio, Fraction) and float(exact) != ratio:
        raise UnitError(f"a unit cannot have the power {float(ratio):g}", "write a ratio such as 1/2")
    if not base.unit.dimension:
        base = Value(base.si.number)
    if base.number == 0 and ratio < 0:
        raise UnitError("there is a division by zero", "divide by another value")
    unit = base.unit**exact if base.unit.exponents else ONE
    if exact.denominator == 1 and exact == ratio and abs(exact) <= _MOST_POWER:
        return Value(base.number ** int(exact), unit)
    if exact == Fraction(1, 2):
        return Value(_root(base.number), unit)
    if base.number < 0:
        raise UnitError(f"a negative number has no power {float(ratio):g}", "give one above zero")
    return Value(float(base.number) ** float(ratio), unit)


def _root(number: Fraction | float) -> Fraction | float:
    """Return the square root, exact if there is an exact one."""
    if number < 0:
        raise UnitError("a negative number has no square root", "give one above zero")
    if isinstance(number, Fraction):
        above, below = math.isqrt(number.numerator), math.isqrt(number.denominator)
        if above**2 == number.numerator and below**2 == number.denominator:
            return Fraction(above, below)
    return math.sqrt(number)


def _negative(value: Value) -> Value:
    return Value(-value.number, value.unit)


def _root_of(value: Value) -> Value:
    return Value(_root(value.number), value.unit ** Fraction(1, 2))


def _size(value: Value) -> Value:
    return _negative(value) if value.number < 0 else value


def _sign_of(value: Value) -> Value:
    return Value(Fraction((value.number > 0) - (value.number < 0)))


_SUMS: dict[str, Callable[..., Value]] = {
    "+": _add, "-": lambda one, other: _add(one, other, -1), "*": _multiply, "/": _divide, "^": _power,
    "neg": _negative, "sqrt": _root_of, "abs": _size, "sign": _sign_of,
}  # fmt: skip
_COMMON = ("min", "max", "mod", "rem", "atan2")
# Functions of a number: the unit that they take, and the one that they give.
_PLAIN: dict[str, tuple[Callable[[float], float], Unit, Unit]] = {
    **{name: (getattr(math, name), RADIAN, ONE) for name in ("sin", "cos", "tan")},
    **{name: (getattr(math, name), ONE, RADIAN) for name in ("asin", "acos", "atan")},
    **{name: (getattr(math, name), ONE, ONE) for name in ("sinh", "cosh", "tanh", "exp", "log", "log10")},
    **{name: (lambda x: x, ONE, ONE) for name in ("floor", "ceil", "round", "fix")},
}  # fmt: skip
_ROUNDED: dict[str, Callable[[Fraction], int]] = {
    "floor": math.floor,
    "ceil": math.ceil,
    "fix": math.trunc,
    "round": lambda x: math.floor(x + Fraction(1, 2)) if x >= 0 else math.ceil(x - Fraction(1, 2)),
}


def _common(function: str, values: Sequence[Value]) -> Value:
    """Return the value of a function whose arguments have one unit."""
    alike = list(values)
    for index in range(1, len(alike)):
        alike[0], alike[index] = _alike(function, alike[0], alike[index])
    alike = [alike[0], *(_alike(function, alike[0], each)[1] for each in alike[1:])]
    one, other = alike[:2]
    if function in ("min", "max"):
        numbers: list[Fraction | float] = [value.number for value in alike]
        return Value(min(numbers) if function == "min" else max(numbers), one.unit)
    if function == "atan2":
        return Value(math.atan2(one.number, other.number), RADIAN)
    if other.number == 0:
        raise UnitError("there is a division by zero", "divide by another value")
    above, below = Fraction(one.number), Fraction(other.number)
    whole = math.floor(above / below) if function == "mod" else math.trunc(above / below)
    return Value(above - below * whole, one.unit)


def _plain(function: str, value: Value) -> Value:
    compute, taken, given = _PLAIN[function]
    if function in _ROUNDED:
        return Value(Fraction(_ROUNDED[function](Fraction(_unit_free(function, value).number))))
    if taken == RADIAN and value.unit.dimension_equals(ONE) and not value.is_zero:
        raise UnitError(f"'{function}' takes an angle, and gets a number", "write it in rad or deg")
    if not (value.is_zero or value.unit.dimension_equals(taken)):
        wanted = "an angle" if taken == RADIAN else "a number"
        raise UnitError(f"'{function}' takes {wanted}, and gets {value.unit.si}")
    try:
        return Value(compute(float(value.si.number)), given)
    except ValueError:
        raise UnitError(f"'{function}' has no value at {float(value.si.number):g}") from None


def _unit_free(function: str, value: Value) -> Value:
    if value.unit.dimension:
        raise UnitError(f"'{function}' takes a number without unit, and gets {value.unit.si}")
    return Value(value.si.number)


def _alike(function: str, one: Value, other: Value) -> tuple[Value, Value]:
    """Return two values in one unit; a 0 without unit fits any."""
    if one.unit == other.unit:
        return one, other
    if other.is_zero:
        return one, Value(Fraction(0), one.unit)
    if one.is_zero:
        return Value(Fraction(0), other.unit), other
    if not one.unit.dimension_equals(other.unit):
        units = [str(value.unit.si) if value.unit.dimension else "a plain number" for value in (one, other)]
        raise UnitError(f"'{function}' joins {units[0]} and {units[1]}", "give both the same unit")
    return one.si, other.si


def _number_text(number: Fraction | float) -> str:
    """Return a number as a quantity has it: exact as far as it is short enough."""
    if isinstance(number, float):
        return repr(number)
    if number.denominator == 1 and number.numerator.bit_length() <= 64:
        return str(number.numerator)
    text = f"{number.numerator}/{number.denominator}"
    return text if len(text) < LONGEST else repr(float(number))
