"""The outcome of a run: statistics of its signals, and verdicts on the diagram's expectations.

NaN meets no expectation, and neither does a run without all samples of the stretch.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.diagram.requirements import EXPECTATIONS, Entry, Expectation, Selection
from quadvis.output.recording import Recorded
from quadvis.output.statistics import COUNT, STATISTICS, Samples, Value, finite


def _distances(selection: Selection, rows: NDArray[Any]) -> Samples:
    """Return the distances (N, elements) of rows of the signal from ``of``."""
    found = rows[(slice(None), *selection.index)]
    return found.reshape(len(found), math.prod(found.shape[1:])).astype(np.float64) - selection.of


class Measured:
    """Statistics of a selection from ``size`` rows, by default all rows of its stretch, as they come."""

    def __init__(self, selection: Selection, names: Iterable[str], size: int | None = None) -> None:
        self.selection, self.found, self.missed = selection, 0, 0
        count = len(selection.stretch.rows) if size is None else size
        self._statistics = {name: STATISTICS[name](count, len(selection.elements)) for name in names}

    def add(self, rows: NDArray[Any]) -> None:
        """Take further rows of the stretch."""
        if not len(rows):
            return
        self.found += len(rows)
        samples = _distances(self.selection, rows)
        with np.errstate(over="ignore", invalid="ignore"):  # a signal that diverges has an infinite RMS
            for statistic in self._statistics.values():
                statistic.add(samples)

    def __getitem__(self, name: str) -> Value:
        return self._statistics[name].value

    @property
    def lack(self) -> str:
        """Why these are not the statistics of the whole stretch; "" if they are.

        Rows that do not exist are no lack, as long as there are others.
        """
        return self.selection.stretch.lack(self.found + (self.missed if self.found else 0))


class Verdict(NamedTuple):
    """An expectation and the value found, in the unit of the elements; NaN if no value was found.

    ``lack`` says why the run cannot be judged: samples of the stretch are missing.
    """

    expectation: Expectation
    found: float
    met: bool
    lack: str = ""

    @property
    def shown(self) -> str:
        """The value that was found, as text."""
        found = "nothing to judge" if math.isnan(self.found) else self.expectation.shows(self.found)
        if self.lack:
            return f"{found}: {self.lack}"
        return " ".join(filter(None, (found, self.expectation.selection.stretch.cut)))

    def facts(self) -> dict[str, Any]:
        """Return the verdict as plain data."""
        selection = self.expectation.selection
        return {
            "expectation": str(self.expectation),
            "signal": selection.text,
            "kind": self.expectation.kind,
            "unit": "1" if self.expectation.statistic == COUNT else str(selection.unit),
            "limit": self.expectation.limit,
            "found": finite(self.found),
            "met": self.met,
            "lack": self.lack or None,
            "shown": self.shown,
        }

    def __str__(self) -> str:
        return verdict_text(self.facts())


def verdict_text(facts: Mapping[str, Any]) -> str:
    """Return a verdict, given as `Verdict.facts` has it, as one text."""
    return f"{verdict_word(facts)}: {facts['expectation']}: {facts['shown']}"


def verdict_word(facts: Mapping[str, Any]) -> str:
    """Return whether an expectation is met, in words."""
    return "met" if facts["met"] else "NOT MET"


def judge(expectation: Expectation, measured: Measured) -> Verdict:
    """Return whether a run meets an expectation; a run without all samples of the stretch does not."""
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
    """Judges a run from its rows as they come, or from a recording."""

    def __init__(self, summary: Sequence[Entry], expectations: Sequence[Expectation]) -> None:
        self._summary, self._expectations = summary, expectations
        wanted = [(entry.selection, entry.show) for entry in summary]
        wanted += [(expectation.selection, (expectation.statistic,)) for expectation in expectations]
        self._measured = [Measured(selection, names) for selection, names in wanted]
        self._by_name: dict[str, list[int]] = {}
        for place, (selection, _) in enumerate(wanted):
            self._by_name.setdefault(selection.name, []).append(place)
        self._wanted = wanted

    @property
    def names(self) -> Iterable[str]:
        """The signals that are judged."""
        return self._by_name.keys()

    def take(self, name: str, number: int, rows: NDArray[Any]) -> None:
        """Take rows of a signal; ``number`` is the number of rows before them since the start of the run."""
        for place in self._by_name[name]:
            wanted = self._measured[place].selection.stretch.rows
            first, last = max(wanted.start - number, 0), max(wanted.stop - number, 0)
            self._measured[place].add(rows[first:last])

    def miss(self, name: str, number: int, count: int) -> None:
        """Note that ``count`` rows do not exist, in place of taking them."""
        for place in self._by_name[name]:
            wanted = self._measured[place].selection.stretch.rows
            self._measured[place].missed += len(
                range(max(wanted.start, number), min(wanted.stop, number + count))
            )

    def read(self, signals: Recorded) -> None:
        """Take all rows of a recording; some rows may be missing."""
        for place, (selection, names) in enumerate(self._wanted):
            first, last = selection.stretch.stamps
            stamps = signals.stamps(selection.name)
            rows = signals[selection.name][(stamps >= first) & (stamps <= last)]
            self._measured[place] = Measured(selection, names, len(rows))
            self._measured[place].add(rows)

    def outcome(self) -> Outcome:
        """Return the summary and the verdicts from the rows taken."""
        entries = zip(self._summary, self._measured, strict=False)
        summary = {entry.label: {name: found[name] for name in entry.show} for entry, found in entries}
        judged = zip(self._expectations, self._measured[len(self._summary) :], strict=True)
        return Outcome(summary, tuple(judge(expectation, found) for expectation, found in judged))
