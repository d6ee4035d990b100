"""What a run showed: statistics of its signals, and whether it met what the diagram expects.

Parts with several elements count element by element: the RMS of ``craft.position[0:2]`` is over both axes together,
its maximum the larger of the two. NaN meets no expectation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.graph import Index
from quadvis.units import Unit, format_quantity


class Signals(Protocol):
    """Recorded signals by name, from a run or from a log: one row per sample."""

    def __getitem__(self, name: str) -> NDArray[Any]: ...
    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times of the rows (s)."""
        ...


@dataclass(frozen=True)
class Part:
    """A signal, or a part of it, over a stretch of the run (s)."""

    name: str
    index: Index = ()
    text: str = ""
    unit: str = "1"
    after: float = 0.0
    before: float = math.inf

    def values(self, signals: Signals) -> NDArray[np.float64]:
        """Return the samples in the stretch, as (N, elements)."""
        times = signals.times(self.name)
        rows = signals[self.name][(times >= self.after) & (times <= self.before)]
        part = rows[(slice(None), *self.index)]
        return part.reshape(len(part), math.prod(part.shape[1:])).astype(float)


@dataclass(frozen=True)
class Kind:
    """A way to judge or describe samples: what it computes and, for expectations, how it is compared."""

    words: str
    compute: Any
    holds: Any = None


def _rms(values: NDArray[np.float64], of: float = 0.0) -> float:
    return float(np.sqrt(np.mean((values - of) ** 2)))


def _max(values: NDArray[np.float64], of: float = 0.0) -> float:
    return float(np.max(np.abs(values - of)))


STATISTICS = {
    "rms": _rms,
    "max": _max,
    "mean": lambda values: float(np.mean(values)),
    "min": lambda values: float(np.min(values)),
    "final": lambda values: float(values[-1, 0]),
    "count": lambda values: float(np.count_nonzero(values.any(axis=1))),
}

EXPECTATIONS: Mapping[str, Kind] = {
    "within": Kind("at most", _max, np.less_equal),
    "rms": Kind("RMS at most", _rms, np.less_equal),
    "below": Kind("always below", lambda values, of: float(np.max(values - of)), np.less),
    "above": Kind("always above", lambda values, of: float(np.min(values - of)), np.greater),
    "count": Kind("at most", lambda values, of: float(np.count_nonzero(values.any(axis=1))), np.less_equal),
}


@dataclass(frozen=True)
class Expectation:
    """One requirement on a run: ``kind`` is a key of EXPECTATIONS, ``limit`` and ``of`` are in SI units."""

    part: Part
    kind: str
    limit: float
    of: float = 0.0

    def judge(self, signals: Signals) -> Verdict:
        """Return whether a run meets it; one without samples in the stretch does not."""
        values = self.part.values(signals)
        found = EXPECTATIONS[self.kind].compute(values, self.of) if len(values) else math.nan
        return Verdict(self, found, bool(EXPECTATIONS[self.kind].holds(found, self.limit)))

    def __str__(self) -> str:
        unit = "1" if self.kind == "count" else self.part.unit
        of = f" of {format_quantity(self.of, Unit.parse(unit))}" if self.of else ""
        after = f" after {self.part.after:g} s" if self.part.after else ""
        limit = format_quantity(self.limit, Unit.parse(unit))
        what = {"count": "true ", "within": "within "}.get(self.kind, EXPECTATIONS[self.kind].words + " ")
        tail = " times at most" if self.kind == "count" else ""
        return f"{self.part.text} {what}{limit}{tail}{of}{after}"


@dataclass(frozen=True)
class Verdict:
    """An expectation with what the run gave (SI units; NaN if it gave nothing)."""

    expectation: Expectation
    found: float
    met: bool

    def __str__(self) -> str:
        unit = "1" if self.expectation.kind == "count" else self.expectation.part.unit
        found = "no samples" if math.isnan(self.found) else format_quantity(self.found, Unit.parse(unit))
        return f"{'met' if self.met else 'NOT MET'}: {self.expectation}: {found}"


@dataclass(frozen=True)
class Entry:
    """A line of the summary: statistics of a part, shown in a unit (``scale`` SI units each)."""

    label: str
    part: Part
    show: tuple[str, ...]
    unit: str = "1"
    scale: float = 1.0

    def compute(self, signals: Signals) -> dict[str, float]:
        """Return the statistics by name, in SI units; NaN without samples."""
        values = self.part.values(signals)
        return {name: STATISTICS[name](values) if len(values) else math.nan for name in self.show}


@dataclass(frozen=True)
class Outcome:
    """The summary and the verdicts of one run."""

    summary: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    verdicts: tuple[Verdict, ...] = ()

    @property
    def passed(self) -> bool:
        """True if every expectation is met."""
        return all(verdict.met for verdict in self.verdicts)
