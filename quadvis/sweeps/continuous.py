"""Axes of any value: a range such as `1..4 rad/s`, or a distribution such as `normal(0.5 kg, 20 g)`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadvis.errors import QuadvisError, quoted
from quadvis.units import Unit, UnitError, split_quantity

EDGE = 2.0**-40  # shares are kept so far from 0 and 1, where an unbounded distribution has no value
TAIL = 0.05  # share beyond each end of the part of a distribution that one-at-a-time looks at

_CALL = re.compile(r"\s*([a-z_]+)\s*\((.*)\)\s*", re.DOTALL)


class Distribution(NamedTuple):
    """A kind of distribution: its arguments, what they must be, and scipy's distribution of them."""

    arguments: tuple[str, ...]
    rule: str
    fits: Callable[..., bool]
    frozen: Callable[..., Any]  # takes scipy.stats and the arguments


# The names and arguments that the textbooks of Monte Carlo methods use; a factor has no unit.
KINDS: Mapping[str, Distribution] = {
    "uniform": Distribution(
        ("LOW", "HIGH"),
        "LOW below HIGH",
        lambda low, high: low < high,
        lambda stats, low, high: stats.uniform(low, high - low),
    ),
    "loguniform": Distribution(
        ("LOW", "HIGH"),
        "0 below LOW below HIGH",
        lambda low, high: 0 < low < high,
        lambda stats, low, high: stats.loguniform(low, high),
    ),
    "normal": Distribution(
        ("MEAN", "DEVIATION"),
        "DEVIATION above 0",
        lambda mean, deviation: deviation > 0,
        lambda stats, mean, deviation: stats.norm(mean, deviation),
    ),
    "truncated_normal": Distribution(
        ("MEAN", "DEVIATION", "LOW", "HIGH"),
        "DEVIATION above 0 and LOW below HIGH",
        lambda mean, deviation, low, high: deviation > 0 and low < high,
        lambda stats, mean, deviation, low, high: stats.truncnorm(
            (low - mean) / deviation, (high - mean) / deviation, mean, deviation
        ),
    ),
    "lognormal": Distribution(
        ("MEDIAN", "FACTOR"),
        "MEDIAN above 0 and FACTOR, the geometric deviation, above 1",
        lambda median, factor: median > 0 and factor > 1,
        lambda stats, median, factor: stats.lognorm(math.log(factor), scale=median),
    ),
    "triangular": Distribution(
        ("LOW", "MODE", "HIGH"),
        "LOW at most MODE at most HIGH, and LOW below HIGH",
        lambda low, mode, high: low <= mode <= high and low < high,
        lambda stats, low, mode, high: stats.triang((mode - low) / (high - low), low, high - low),
    ),
}


@dataclass(frozen=True)
class ContinuousAxis:
    """One axis of a design: a parameter, whose values have a distribution.

    ``arguments`` are those of the kind of distribution, in ``unit``, in which the values are, too; ``given``
    is the text that the axis was read from.
    """

    name: str
    given: str
    kind: str
    arguments: tuple[float, ...]
    unit: str = ""

    @property
    def column(self) -> str:
        """The name of the axis's column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def frozen(self) -> Any:
        """The distribution, as scipy has it."""
        from scipy import stats

        return KINDS[self.kind].frozen(stats, *self.arguments)

    def at(self, shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values below which these shares, 0 to 1, of the distribution lie."""
        if self.kind != "uniform":
            shares = np.clip(shares, EDGE, 1.0 - EDGE)
        found: NDArray[np.float64] = np.asarray(self.frozen.ppf(shares), np.float64)
        return found

    def spread(self, count: int) -> NDArray[np.float64]:
        """Return so many values from end to end: of a distribution that is no range, without its tails."""
        tail = 0.0 if self.kind == "uniform" else TAIL
        return self.at(np.linspace(tail, 1.0 - tail, count))

    def cells(self, places: ArrayLike) -> NDArray[np.float64]:
        """Return the column for these values: NaN is the diagram's own."""
        return np.array(places, np.float64)

    def text(self, place: float) -> str:
        """Return a value, as for ``--set``, to the bit."""
        return f"{float(place)!r} {self.unit}".rstrip()

    def label(self, place: float) -> str:
        """Return a value as a short text."""
        return f"{place:.6g} {self.unit}".rstrip()

    @property
    def key(self) -> str:
        """A text that is equal for equal axes alone."""
        return repr((self.name, self.kind, self.arguments, self.unit))


def is_distribution(text: str) -> bool:
    """Return whether a text is a distribution, such as ``normal(1, 2)``, right or wrong."""
    match = _CALL.fullmatch(text)
    return match is not None and match[1] in KINDS


def read_distribution(name: str, text: str) -> ContinuousAxis:
    """Return an axis from a text such as ``normal(0.5 kg, 20 g)``.

    QuadvisError if it has other arguments than its kind, or they do not fit.
    """
    match = _CALL.fullmatch(text)
    assert match is not None
    kind = KINDS[match[1]]
    given = [part.strip() for part in match[2].split(",")]
    if len(given) != len(kind.arguments) or not all(given):
        raise QuadvisError(f"{quoted(text)} of '{name}' is not {match[1]}({', '.join(kind.arguments)})")
    factor = kind.arguments.index("FACTOR") if "FACTOR" in kind.arguments else None
    unit, arguments = _numbers(name, text, given, factor)
    if not kind.fits(*arguments):
        raise QuadvisError(f"{quoted(text)} of '{name}' does not fit; it needs {kind.rule}")
    return ContinuousAxis(name, text, match[1], arguments, unit)


def read_uniform(name: str, text: str, low: str, high: str) -> ContinuousAxis:
    """Return an axis of any value of a range, such as ``1..4 rad/s``. QuadvisError if it is no range."""
    unit, arguments = _numbers(name, text, [low, high])
    if not arguments[0] < arguments[1]:
        raise QuadvisError(f"the range {quoted(text)} of '{name}' goes down; write its lower end first")
    return ContinuousAxis(name, text, "uniform", arguments, unit)


def _numbers(
    name: str, text: str, given: Sequence[str], factor: int | None = None
) -> tuple[str, tuple[float, ...]]:
    """Return the unit that is written first, and all numbers in it; those without one are in the last."""
    pairs = [split_quantity(each) for each in given]
    units = [unit for number, (_, unit) in enumerate(pairs) if unit and number != factor]
    own, last = (units[0], units[-1]) if units else ("", "")
    try:
        scale, found = Unit.parse(own or "1"), []
        for number, (digits, unit) in enumerate(pairs):
            each = Unit.parse((unit if number == factor else unit or last) or "1")
            whole = Unit.parse("1") if number == factor else scale
            if not each.dimension_equals(whole) or each.variables:
                problem = f"{quoted(given[number])} does not have the unit of the other numbers"
                raise QuadvisError(f"in {quoted(text)} of '{name}' {problem}")
            found.append(float(Fraction(digits)) * (each.scale / whole.scale))
    except (UnitError, ValueError, ArithmeticError):
        raise QuadvisError(f"{quoted(text)} of '{name}' needs plain numbers with their unit") from None
    if not np.isfinite(found).all():
        raise QuadvisError(f"{quoted(text)} of '{name}' needs plain numbers with their unit")
    return own, tuple(found)
