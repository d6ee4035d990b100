"""The axes of a sweep: `seed=0..29`, `craft.lag=20 ms,50 ms`, `bandwidth=1..3 step 0.5 rad/s`.

An axis has places, as numbers: of its levels their indices, of a distribution (see `continuous`) its values.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadvis.diagram.settings import value_text
from quadvis.errors import QuadvisError, quoted
from quadvis.errors.caller import as_given
from quadvis.sweeps.continuous import ContinuousAxis, is_distribution, read_distribution, read_uniform
from quadvis.sweeps.steps import StepNumbers, Steps
from quadvis.units import Unit, UnitError, split_quantity

SEED, VARIANT, PARAMS = "seed", "variant", "params"
NONE = "none"  # a value that means no variant, or no parameter file
MOST_VALUES = 1_000_000  # of an axis
LARGEST = 18  # most digits of the ends of a range

GRID = "grid"  # the design of all combinations

WHOLE = re.compile(r"[+-]?\d{1,18}")
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
    values: Sequence[str]
    numbers: Sequence[float] = ()
    unit: str = ""
    are_whole: bool = False

    @property
    def column(self) -> str:
        """The name of the axis's column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def cells(self, places: ArrayLike) -> NDArray[Any]:
        """Return the column - integers, numbers or texts - for these indices of values.

        NaN, which is the diagram's own value, gives an empty text, or makes the column one of numbers with
        NaN.
        """
        given = np.asarray(places, np.float64)
        own = np.isnan(given)
        indices = np.where(own, 0, given).astype(np.int64).tolist()
        if not self.numbers:
            return np.where(own, "", np.array([self.values[index] for index in indices], dtype=np.str_))
        if self.are_whole and not own.any():
            return np.array([int(self.values[index]) for index in indices], dtype=np.int64)
        return np.where(own, np.nan, np.array([self.numbers[index] for index in indices], dtype=np.float64))

    def at(self, shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the places of shares 0 to 1: each value has the same part of them."""
        count = len(self.values)
        return np.minimum(np.floor(shares * count), count - 1)

    def text(self, place: float) -> str:
        """Return a value, as for ``--set``."""
        return self.values[int(place)]

    def label(self, place: float) -> str:
        """Return a value as a short text: of a parameter file its name without the folder."""
        value = self.text(place)
        return Path(value).stem if self.name == PARAMS else value

    @property
    def key(self) -> str:
        """A text that is equal for equal axes alone."""
        return repr((self.name, self.values if isinstance(self.values, Steps) else tuple(self.values)))


AnyAxis = Axis | ContinuousAxis


def read_axes(over: Over, design: str = GRID) -> tuple[AnyAxis, ...]:
    """Return the axes in their order; QuadvisError if an axis has no values or is given twice.

    In a grid each is a list of values. In other designs a range without a step, or a distribution, gives any
    value.
    """
    given: Iterable[tuple[str, Any]]
    given = over.items() if isinstance(over, Mapping) else [_split_name(text) for text in over]
    axes: dict[str, AnyAxis] = {}
    for name, values in given:
        if name in axes:
            raise QuadvisError(f"'{name}' is swept over twice; give all its values at once")
        axes[name] = _read_axis(name, values, design)
    if not axes:
        example = as_given("--over, such as seed=0..29", "an axis, such as {'seed': range(30)}")
        raise QuadvisError(f"there is nothing to sweep over; give {example}")
    return tuple(axes.values())


def read_seeds(text: str) -> tuple[int, ...]:
    """Return the seeds of a text such as "0..9"; QuadvisError if they are none."""
    return tuple(map(int, _axis(SEED, _read(SEED, text)).values))


def _read_axis(name: str, values: Any, design: str) -> AnyAxis:
    if not isinstance(values, str):
        return _axis(name, [_text(name, value) for value in values])
    if is_distribution(values):
        if design == GRID:
            remedy = as_given("add such as --design latin_hypercube", "give a design")
            raise QuadvisError(f"a grid has no distributions such as {quoted(values)} of '{name}'; {remedy}")
        if name in (SEED, VARIANT, PARAMS):
            raise QuadvisError(f"'{name}' has no distribution; list its values, which are drawn alike often")
        return read_distribution(name, values)
    match = _RANGE.fullmatch(values) if design != GRID and name not in (SEED, VARIANT, PARAMS) else None
    if match is not None and match["step"] is None and split_quantity(match["first"])[0]:
        return read_uniform(name, values, match["first"], match["last"])
    return _axis(name, _read(name, values))


def _split_name(text: str) -> tuple[str, str]:
    name, sign, values = (part.strip() for part in text.partition("="))
    if not name or not sign:
        raise QuadvisError(f"{quoted(text)} names nothing to sweep over; write such as 'seed=0..29'")
    return name, values


def _text(name: str, value: Any) -> str:
    if value is None and name in (VARIANT, PARAMS):
        return NONE
    return value_text(value)


def _read(name: str, text: str) -> Sequence[str]:
    parts = [part.strip() for part in _split_commas(text)]
    if not all(parts):
        raise QuadvisError(f"'{name}' lacks a value in {quoted(text)}; write such as '{name}=1,2' or '1..5'")
    expanded = [_expand(name, part) for part in parts]
    return expanded[0] if len(expanded) == 1 else [value for values in expanded for value in values]


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


def _expand(name: str, text: str) -> Sequence[str]:
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
    if (last - first) / step >= MOST_VALUES:
        raise QuadvisError(f"the range {quoted(text)} of '{name}' has more than {MOST_VALUES} values")
    return Steps(first, step, int((last - first) / step) + 1, units[0] if units else "")


def _axis(name: str, values: Sequence[str]) -> Axis:
    if not values:
        raise QuadvisError(f"'{name}' has no values to sweep over; give some")
    if not isinstance(values, Steps):
        twice, count = Counter(values).most_common(1)[0]
        if count > 1:
            raise QuadvisError(f"'{name}' takes the value {quoted(twice)} twice; leave out one")
        values = tuple(values)
    if name == SEED:
        for value in (values[0], values[1 % len(values)]) if isinstance(values, Steps) else values:
            if WHOLE.fullmatch(value) is None:
                raise QuadvisError(f"the seed {quoted(value)} must be a whole number of at most 18 digits")
    axis = Axis(name, values)
    return axis if name in (VARIANT, PARAMS) else _numeric(axis)


def _numeric(axis: Axis) -> Axis:
    """Return the axis with its numbers in the unit of the first value, if all have the same dimension."""
    steps = isinstance(axis.values, Steps)
    pairs = [split_quantity(value) for value in (axis.values[:1] if steps else axis.values)]
    try:
        units = [Unit.parse(unit or "1") for _, unit in pairs]
        numbers = [float(Fraction(number)) for number, _ in pairs]
    except (UnitError, ValueError, ArithmeticError):
        return axis
    if not all(unit.dimension_equals(units[0]) and not unit.variables for unit in units):
        return axis
    if isinstance(axis.values, Steps):
        are_whole = axis.values.are_whole
        return replace(axis, numbers=StepNumbers(axis.values), unit=pairs[0][1], are_whole=are_whole)
    scaled = (number * (unit.scale / units[0].scale) for number, unit in zip(numbers, units, strict=True))
    are_whole = all(map(WHOLE.fullmatch, axis.values))
    return replace(axis, numbers=tuple(scaled), unit=pairs[0][1], are_whole=are_whole)
