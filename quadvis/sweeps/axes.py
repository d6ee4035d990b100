"""The axes of a sweep: `seed=0..29`, `craft.lag=20 ms,50 ms`, `bandwidth=1..3 step 0.5 rad/s`."""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.diagram.settings import value_text
from quadvis.errors import QuadvisError, quoted
from quadvis.errors.caller import as_given
from quadvis.units import Unit, UnitError, split_quantity

SEED, VARIANT, PARAMS = "seed", "variant", "params"
NONE = "none"  # a value that means no variant, or no parameter file
MOST_RUNS = 100_000
LARGEST = 18  # most digits of the ends of a range

_RANGE = re.compile(r"(?P<first>.+?)\.\.(?P<last>.+?)(?:\s+step\s+(?P<step>.+))?", re.DOTALL)
_PAIRS = {"[": "]", "{": "}", "(": ")", "'": "'", '"': '"'}

Over = Mapping[str, Any] | Sequence[str]


@dataclass(frozen=True)
class Axis:
    """One axis of the grid: a parameter, the seed, the variant or the parameter file, with its values.

    ``values`` are texts, as for ``--set``. If all of them are single quantities of one dimension, ``numbers``
    are their values in ``unit``, and the column of the table is numeric and names the unit.
    """

    name: str
    values: tuple[str, ...]
    numbers: tuple[float, ...] = ()
    unit: str = ""

    @property
    def column(self) -> str:
        """The name of the axis's column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def cells(self, indices: Sequence[int]) -> NDArray[Any]:
        """Return the column - integers, numbers or texts - for these indices of values."""
        found: Sequence[Any] = self.numbers or self.values
        kind: Any = np.float64 if self.numbers else np.str_
        if self.numbers and all(re.fullmatch(r"[+-]?\d{1,18}", value) for value in self.values):
            found, kind = [int(value) for value in self.values], np.int64
        return np.array([found[index] for index in indices], dtype=kind)

    def label(self, index: int) -> str:
        """Return a value as a short text: of a parameter file its name without the folder."""
        value = self.values[index]
        return Path(value).stem if self.name == PARAMS else value


def read_axes(over: Over) -> tuple[Axis, ...]:
    """Return the axes in their order; QuadvisError if an axis has no values or is given twice."""
    given: Iterable[tuple[str, Any]]
    given = over.items() if isinstance(over, Mapping) else [_split_name(text) for text in over]
    axes: dict[str, Axis] = {}
    for name, values in given:
        if name in axes:
            raise QuadvisError(f"'{name}' is swept over twice; give all its values at once")
        texts = _read(name, values) if isinstance(values, str) else [_text(name, value) for value in values]
        axes[name] = _axis(name, texts)
    if not axes:
        example = as_given("--over, such as seed=0..29", "an axis, such as {'seed': range(30)}")
        raise QuadvisError(f"there is nothing to sweep over; give {example}")
    count = math.prod(len(axis.values) for axis in axes.values())
    if count > MOST_RUNS:
        raise QuadvisError(f"these are {count} runs; at most {MOST_RUNS} go into one sweep")
    return tuple(axes.values())


def points(axes: Sequence[Axis]) -> list[tuple[int, ...]]:
    """Return, for every run, the index of its value on each axis; the last axis changes fastest."""
    return list(itertools.product(*(range(len(axis.values)) for axis in axes)))


def _split_name(text: str) -> tuple[str, str]:
    name, sign, values = (part.strip() for part in text.partition("="))
    if not name or not sign:
        raise QuadvisError(f"{quoted(text)} names nothing to sweep over; write such as 'seed=0..29'")
    return name, values


def _text(name: str, value: Any) -> str:
    if value is None and name in (VARIANT, PARAMS):
        return NONE
    return value_text(value)


def _read(name: str, text: str) -> list[str]:
    parts = [part.strip() for part in _split_commas(text)]
    if not all(parts):
        raise QuadvisError(f"'{name}' lacks a value in {quoted(text)}; write such as '{name}=1,2' or '1..5'")
    return [value for part in parts for value in _expand(name, part)]


def _split_commas(text: str) -> Iterator[str]:
    """Yield the texts between commas; commas inside brackets and quotes do not split."""
    closing: list[str] = []
    start = 0
    for position, sign in enumerate(text):
        if closing and sign == closing[-1]:
            closing.pop()
        elif sign in _PAIRS and not (closing and closing[-1] in "'\""):
            closing.append(_PAIRS[sign])
        elif sign == "," and not closing:
            yield text[start:position]
            start = position + 1
    yield text[start:]


def _expand(name: str, text: str) -> list[str]:
    """Return the values of a range such as ``1..3 step 0.5 rad/s``, or the text itself as one value."""
    match = _RANGE.fullmatch(text)
    if match is None:
        return [text]
    ends = [split_quantity(match[end] or "") for end in ("first", "last", "step")]
    if not (ends[0][0] and ends[1][0]):
        return [text]  # such as ../sets/s1.yaml
    units = list(dict.fromkeys(unit for _, unit in ends if unit))
    if len(units) > 1:
        problem = f"the range {quoted(text)} of '{name}' is in {' and in '.join(units)}"
        raise QuadvisError(f"{problem}; write it in one unit, once, at its end")
    try:
        first, last, step = (Decimal(number or 1) for number, _ in ends)
    except InvalidOperation:
        first = last = step = Decimal("nan")
    if not all(end.is_finite() and -LARGEST < end.adjusted() < LARGEST for end in (first, last, step)):
        raise QuadvisError(f"the range {quoted(text)} of '{name}' needs plain numbers")
    whole = first == int(first) and last == int(last) and not units
    if match["step"] is None and not whole:
        remedy = f"write such as '{text} step {'0.1' if last - first <= 1 else '1'}'"
        raise QuadvisError(f"the range {quoted(text)} of '{name}' has no step; {remedy}")
    if step <= 0:
        raise QuadvisError(f"the step of the range {quoted(text)} of '{name}' must be above 0")
    if last < first:
        raise QuadvisError(f"the range {quoted(text)} of '{name}' goes down; write its lower end first")
    if (last - first) / step >= MOST_RUNS:
        raise QuadvisError(f"the range {quoted(text)} of '{name}' has more than {MOST_RUNS} values")
    unit = f" {units[0]}" if units else ""
    return [f"{_plain(first + index * step)}{unit}" for index in range(int((last - first) / step) + 1)]


def _plain(value: Decimal) -> str:
    """Return a decimal number without an exponent and without trailing zeros."""
    text = f"{value:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _axis(name: str, values: Sequence[str]) -> Axis:
    if not values:
        raise QuadvisError(f"'{name}' has no values to sweep over; give some")
    twice, count = Counter(values).most_common(1)[0]
    if count > 1:
        raise QuadvisError(f"'{name}' takes the value {quoted(twice)} twice; leave out one")
    axis = Axis(name, tuple(values))
    if name == SEED:
        for value in values:
            if re.fullmatch(r"[+-]?\d{1,18}", value) is None:
                raise QuadvisError(f"the seed {quoted(value)} must be a whole number of at most 18 digits")
    return axis if name in (VARIANT, PARAMS) else _numeric(axis)


def _numeric(axis: Axis) -> Axis:
    """Return the axis with its numbers in the unit of the first value, if all have the same dimension."""
    pairs = [split_quantity(value) for value in axis.values]
    try:
        units = [Unit.parse(unit or "1") for _, unit in pairs]
        numbers = [float(Fraction(number)) for number, _ in pairs]
    except (UnitError, ValueError, ArithmeticError):
        return axis
    if not all(unit.dimension_equals(units[0]) and not unit.variables for unit in units):
        return axis
    scaled = (number * (unit.scale / units[0].scale) for number, unit in zip(numbers, units, strict=True))
    return replace(axis, numbers=tuple(scaled), unit=pairs[0][1])
