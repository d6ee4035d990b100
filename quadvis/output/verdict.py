"""What a run showed: statistics of its signals, and whether it met what the diagram expects.

Parts with several elements count element by element: the RMS of ``craft.position[0:2]`` is over both axes
together, its maximum the larger of the two. NaN meets no expectation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.graph import Index
from quadvis.units import Unit

ONE = Unit()
Samples = NDArray[np.float64]


class Signals(Protocol):
    """Recorded signals by name, from a run or from a log: one row per sample."""

    def __getitem__(self, name: str) -> NDArray[Any]: ...
    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times of the rows (s)."""
        ...


@dataclass(frozen=True)
class Part:
    """A signal, or a part of it, over a stretch of the run (s); it is judged by its distance from ``of``.

    ``unit`` is the unit of the elements, ``shown`` the one that people read them in.
    """

    name: str
    index: Index = ()
    text: str = ""
    unit: Unit = ONE
    shown: Unit = ONE
    of: float = 0.0
    after: float = 0.0
    before: float = math.inf

    def values(self, signals: Signals) -> Samples:
        """Return the distances from ``of`` in the stretch, as (N, elements)."""
        times = signals.times(self.name)
        rows = signals[self.name][(times >= self.after) & (times <= self.before)]
        part = rows[(slice(None), *self.index)]
        return part.reshape(len(part), math.prod(part.shape[1:])).astype(np.float64) - self.of

    def shows(self, value: float) -> str:
        """Return a value of the elements for people."""
        number = f"{value * self.unit.scale / self.shown.scale:.4g}"
        return f"{number} {self.shown}" if self.shown.symbols else number

    @property
    def stretch(self) -> str:
        """The stretch of the run in words; empty if it is all of it."""
        after = f"after {self.after:g} s" if self.after else ""
        before = f"before {self.before:g} s" if math.isfinite(self.before) else ""
        return " and ".join(filter(None, (after, before)))


def _count(values: Samples) -> float:
    return float(np.count_nonzero(values.any(axis=1)))


STATISTICS: Mapping[str, Callable[[Samples], float]] = {
    "rms": lambda values: float(np.sqrt(np.mean(values**2))),
    "max": lambda values: float(np.max(np.abs(values))),
    "mean": lambda values: float(np.mean(values)),
    "lowest": lambda values: float(np.min(values)),
    "highest": lambda values: float(np.max(values)),
    "final": lambda values: float(values[-1, 0]),
    "count": _count,
}
"""Of distances from ``of``: ``max`` is the largest of their magnitudes, ``count`` that of samples not 0."""


@dataclass(frozen=True)
class Kind:
    """A way to judge samples: the statistic, how it is compared with the limit, and how that is said."""

    statistic: str
    holds: Callable[[float, float], bool]
    words: str


EXPECTATIONS: Mapping[str, Kind] = {
    "within": Kind("max", lambda found, limit: found <= limit, "within {limit}{of}"),
    "rms": Kind("rms", lambda found, limit: found <= limit, "rms at most {limit}{of}"),
    "below": Kind("highest", lambda found, limit: found < limit, "always below {limit}{of}"),
    "above": Kind("lowest", lambda found, limit: found > limit, "always above {limit}{of}"),
    "count": Kind("count", lambda found, limit: found <= limit, "true at most {limit} times"),
}


@dataclass(frozen=True)
class Expectation:
    """One requirement on a run: ``kind`` is a key of EXPECTATIONS, ``limit`` in the unit of the elements."""

    part: Part
    kind: str
    limit: float

    def judge(self, signals: Signals) -> Verdict:
        """Return whether a run meets it; one without samples in the stretch does not."""
        kind = EXPECTATIONS[self.kind]
        found = statistic(kind.statistic, self.part.values(signals))
        return Verdict(self, found, not math.isnan(found) and kind.holds(found, self.limit))

    def __str__(self) -> str:
        of = f" of {self.part.shows(self.part.of)}" if self.part.of else ""
        what = EXPECTATIONS[self.kind].words.format(limit=self.shows(self.limit), of=of)
        return " ".join(filter(None, (self.part.text, what, self.part.stretch)))

    def shows(self, value: float) -> str:
        """Return a limit, or what was found, for people."""
        return f"{value:g}" if self.kind == "count" else self.part.shows(value)


@dataclass(frozen=True)
class Verdict:
    """An expectation with what the run gave, in the unit of the elements; NaN if it gave nothing to judge."""

    expectation: Expectation
    found: float
    met: bool

    @property
    def shown(self) -> str:
        """What the run gave, for people."""
        return "nothing to judge" if math.isnan(self.found) else self.expectation.shows(self.found)

    def facts(self) -> dict[str, Any]:
        """Return the verdict as plain data."""
        part, kind = self.expectation.part, self.expectation.kind
        return {
            "expectation": str(self.expectation),
            "signal": part.text,
            "kind": kind,
            "unit": "1" if kind == "count" else str(part.unit),
            "limit": self.expectation.limit,
            "found": finite(self.found),
            "met": self.met,
        }

    def __str__(self) -> str:
        return f"{'met' if self.met else 'NOT MET'}: {self.expectation}: {self.shown}"


@dataclass(frozen=True)
class Entry:
    """A line of the summary: statistics of a part."""

    label: str
    part: Part
    show: tuple[str, ...]

    def compute(self, signals: Signals) -> dict[str, float]:
        """Return the statistics by name, in the unit of the elements; NaN without samples."""
        values = self.part.values(signals)
        return {name: statistic(name, values) for name in self.show}

    def shows(self, name: str, value: float) -> str:
        """Return one of the statistics for people."""
        if math.isnan(value):
            return "none"
        return f"{value:g}" if name == "count" else self.part.shows(value)


def finite(value: float) -> float | None:
    """Return a number as JSON can hold it: None if it is infinite or none."""
    return value if math.isfinite(value) else None


def statistic(name: str, values: Samples) -> float:
    """Return one of STATISTICS; NaN if there are no samples, or if NaN is among them."""
    with np.errstate(over="ignore"):  # what has run away far enough has an infinite RMS
        return STATISTICS[name](values) if values.size else math.nan


@dataclass(frozen=True)
class Outcome:
    """The summary and the verdicts of one run."""

    summary: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    verdicts: tuple[Verdict, ...] = ()

    @property
    def passed(self) -> bool:
        """True if every expectation is met."""
        return all(verdict.met for verdict in self.verdicts)
