"""What a run showed: statistics of its signals, and whether it met what the diagram expects.

Parts with several elements count element by element: the RMS of ``craft.position[0:2]`` is over both axes
together, its maximum the larger of the two, its final value one number for each. NaN meets no expectation,
and neither does a run that has not all samples of the window.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.block import Shape
from quadvis.engine.graph import Index
from quadvis.engine.names import index_text
from quadvis.output.statistics import COUNT, STATISTICS, Samples, Value
from quadvis.output.stretch import Sampling, Stretch
from quadvis.units import Unit

ONE = Unit()
WHOLE = Stretch(Sampling())


class Signals(Protocol):
    """Recorded signals by name, from a run or from a log: one row per sample."""

    def __getitem__(self, name: str) -> NDArray[Any]: ...
    def stamps(self, name: str) -> NDArray[np.int64]:
        """Return the stamps of the rows (ns)."""
        ...


@dataclass(frozen=True)
class Part:
    """A signal, or a part of it, over a stretch of the run; it is judged by its distance from ``of``.

    ``shape`` is that of the whole signal. ``unit`` is the unit of the elements, ``shown`` the one that people
    read them in.
    """

    name: str
    index: Index = ()
    text: str = ""
    unit: Unit = ONE
    shown: Unit = ONE
    of: float = 0.0
    stretch: Stretch = WHOLE
    shape: Shape = ()

    @property
    def elements(self) -> tuple[str, ...]:
        """The elements as a diagram writes them, "[0]" or "[2,1]"; "" if there is one only."""
        places = np.arange(math.prod(self.shape)).reshape(self.shape)[self.index].ravel().tolist()
        if len(places) == 1:
            return ("",)
        return tuple(index_text(tuple(map(int, np.unravel_index(place, self.shape)))) for place in places)

    def distances(self, rows: NDArray[Any]) -> Samples:
        """Return the distances from ``of`` in rows of the signal, as (N, elements)."""
        part = rows[(slice(None), *self.index)]
        return part.reshape(len(part), math.prod(part.shape[1:])).astype(np.float64) - self.of

    def scaled(self, value: float) -> float:
        """Return a value of the elements in the unit that people read."""
        return value * self.unit.scale / self.shown.scale

    def shows(self, value: Value) -> str:
        """Return a value of the elements for people; of several elements, all of them."""
        if isinstance(value, tuple):
            number = f"({', '.join(f'{self.scaled(each):.4g}' for each in value)})"
        else:
            number = f"{self.scaled(value):.4g}"
        return f"{number} {self.shown}" if self.shown.symbols else number


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
        samples = self.part.distances(rows)
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
    "count": Kind(COUNT, lambda found, limit: found <= limit, "true at most {limit} times"),
    "at_least": Kind(COUNT, lambda found, limit: found >= limit, "true at least {limit} times"),
}


@dataclass(frozen=True)
class Expectation:
    """One requirement on a run: ``kind`` is a key of EXPECTATIONS, ``limit`` in the unit of the elements."""

    part: Part
    kind: str
    limit: float

    @property
    def statistic(self) -> str:
        """The name of the statistic that is compared with the limit."""
        return EXPECTATIONS[self.kind].statistic

    def judge(self, measured: Measured) -> Verdict:
        """Return whether a run meets it; one that has not all samples of the window does not."""
        found = measured[self.statistic]
        assert isinstance(found, float)
        lack = measured.lack
        holds = not math.isnan(found) and EXPECTATIONS[self.kind].holds(found, self.limit)
        return Verdict(self, found, holds and not lack, lack)

    def __str__(self) -> str:
        of = f" of {self.part.shows(self.part.of)}" if self.part.of else ""
        what = EXPECTATIONS[self.kind].words.format(limit=self.shows(self.limit), of=of)
        return " ".join(filter(None, (self.part.text, what, str(self.part.stretch))))

    def shows(self, value: float) -> str:
        """Return a limit, or what was found, for people."""
        return f"{value:g}" if self.statistic == COUNT else self.part.shows(value)


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


@dataclass(frozen=True)
class Entry:
    """A line of the summary: statistics of a part."""

    label: str
    part: Part
    show: tuple[str, ...]

    def shows(self, name: str, value: Value) -> str:
        """Return one of the statistics for people."""
        if isinstance(value, float) and math.isnan(value):
            return "none"
        return f"{value:g}" if name == COUNT else self.part.shows(value)


def finite(value: Value) -> Any:
    """Return a value as JSON can hold it: None in place of a number that is infinite or none."""
    if isinstance(value, tuple):
        return [finite(each) for each in value]
    return value if math.isfinite(value) else None


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

    def read(self, signals: Signals) -> None:
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
        return Outcome(summary, tuple(expectation.judge(found) for expectation, found in judged))
