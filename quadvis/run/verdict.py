"""What a run showed: statistics of its signals, and whether it met what the diagram requires.

NaN meets no expectation, and neither does a run that has not all samples of the window.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.diagram.requirements import EXPECTATIONS, Entry, Expectation, Part
from quadvis.output.recording import Recorded
from quadvis.output.statistics import COUNT, STATISTICS, Samples, Value, finite


def _distances(part: Part, rows: NDArray[Any]) -> Samples:
    """Return the distances of a part from its ``of`` in rows of the signal, as (N, elements)."""
    found = rows[(slice(None), *part.index)]
    return found.reshape(len(found), math.prod(found.shape[1:])).astype(np.float64) - part.of


class Measured:
    """Statistics of a part, taken as the rows of its stretch come: ``size`` of them, or all there may be."""

    def __init__(self, part: Part, names: Iterable[str], size: int | None = None) -> None:
        self.part, self.found = part, 0
        count = len(part.stretch.rows) if size is None else size
        self._statistics = {name: STATISTICS[name](count, len(part.elements)) for name in names}

    def add(self, rows: NDArray[Any]) -> None:
        """Take rows of the stretch."""
        if not len(rows):
            return
        self.found += len(rows)
        samples = _distances(self.part, rows)
        with np.errstate(over="ignore", invalid="ignore"):  # what runs away far enough has an infinite RMS
            for statistic in self._statistics.values():
                statistic.add(samples)

    def __getitem__(self, name: str) -> Value:
        return self._statistics[name].value

    @property
    def lack(self) -> str:
        """Why these are not the statistics of the whole stretch; empty if they are."""
        return self.part.stretch.lack(self.found)


@dataclass(frozen=True)
class Verdict:
    """An expectation with what the run gave, in the unit of the elements; NaN if it gave nothing to judge.

    ``lack`` says why the run cannot be judged: it has not all samples of the window.
    """

    expectation: Expectation
    found: float
    met: bool
    lack: str = ""

    @property
    def shown(self) -> str:
        """What the run gave, for people."""
        found = "nothing to judge" if math.isnan(self.found) else self.expectation.shows(self.found)
        if self.lack:
            return f"{found}: {self.lack}"
        return " ".join(filter(None, (found, self.expectation.part.stretch.cut)))

    def facts(self) -> dict[str, Any]:
        """Return the verdict as plain data."""
        part = self.expectation.part
        return {
            "expectation": str(self.expectation),
            "signal": part.text,
            "kind": self.expectation.kind,
            "unit": "1" if self.expectation.statistic == COUNT else str(part.unit),
            "limit": self.expectation.limit,
            "found": finite(self.found),
            "met": self.met,
            "lack": self.lack or None,
        }

    def __str__(self) -> str:
        return f"{'met' if self.met else 'NOT MET'}: {self.expectation}: {self.shown}"


def judge(expectation: Expectation, measured: Measured) -> Verdict:
    """Return whether a run meets an expectation; one that has not all samples of the window does not."""
    found = measured[expectation.statistic]
    assert isinstance(found, float)
    lack = measured.lack
    holds = not math.isnan(found) and EXPECTATIONS[expectation.kind].holds(found, expectation.limit)
    return Verdict(expectation, found, holds and not lack, lack)


@dataclass(frozen=True)
class Outcome:
    """The summary and the verdicts of one run."""

    summary: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)
    verdicts: tuple[Verdict, ...] = ()

    @property
    def passed(self) -> bool:
        """True if every expectation is met."""
        return all(verdict.met for verdict in self.verdicts)


class Judging:
    """Judges a run while it goes on, from the rows as they come, or a recording of one."""

    def __init__(self, summary: Sequence[Entry], expectations: Sequence[Expectation]) -> None:
        self._summary, self._expectations = summary, expectations
        wanted = [(entry.part, entry.show) for entry in summary]
        wanted += [(expectation.part, (expectation.statistic,)) for expectation in expectations]
        self._measured = [Measured(part, names) for part, names in wanted]
        self._by_name: dict[str, list[int]] = {}
        for place, (part, _) in enumerate(wanted):
            self._by_name.setdefault(part.name, []).append(place)
        self._wanted = wanted

    @property
    def names(self) -> Iterable[str]:
        """The signals that are looked at."""
        return self._by_name.keys()

    def take(self, name: str, number: int, rows: NDArray[Any]) -> None:
        """Take rows of a signal; ``number`` counts those before, from the first row of the run."""
        for place in self._by_name[name]:
            wanted = self._measured[place].part.stretch.rows
            first, last = max(wanted.start - number, 0), max(wanted.stop - number, 0)
            self._measured[place].add(rows[first:last])

    def read(self, signals: Recorded) -> None:
        """Take all rows of a recording, in which some may be missing."""
        for place, (part, names) in enumerate(self._wanted):
            first, last = part.stretch.stamps
            stamps = signals.stamps(part.name)
            rows = signals[part.name][(stamps >= first) & (stamps <= last)]
            self._measured[place] = Measured(part, names, len(rows))
            self._measured[place].add(rows)

    def outcome(self) -> Outcome:
        """Return the summary and the verdicts of what was taken."""
        entries = zip(self._summary, self._measured, strict=False)
        summary = {entry.label: {name: found[name] for name in entry.show} for entry, found in entries}
        judged = zip(self._expectations, self._measured[len(self._summary) :], strict=True)
        return Outcome(summary, tuple(judge(expectation, found) for expectation, found in judged))
