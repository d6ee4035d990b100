"""Find the value of a parameter at which the loop becomes unstable, loading the diagram for each value."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from quadvis.analysis.linearise import linearised
from quadvis.analysis.loops import AnalysisError
from quadvis.analysis.margins import growth
from quadvis.analysis.progress import task
from quadvis.analysis.systems import library
from quadvis.diagram.load import varied
from quadvis.diagram.sections.analyse import Limit
from quadvis.errors import RunError
from quadvis.native.choice import AUTO

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

STEPS = 10  # in the search for an unstable value
PRECISION = 1e-5  # of the value found, relative to the value and to the range
STABLE = -1e-6  # 1/s; a pole that decays more slowly counts as unstable


@dataclass(frozen=True)
class Tolerance:
    """The tolerance of a parameter: its last stable ``value`` (SI).

    The value is the end of the range if the whole range is stable, and NaN if its start is unstable. If the
    loop does not become unstable but cannot be analysed beyond the value, ``reason`` says why.
    """

    limit: Limit
    value: float
    reason: str = ""

    @property
    def reached(self) -> bool:
        """True if the loop is lost within the range."""
        return self.value != self.limit.end

    @property
    def text(self) -> str:
        """The answer in words."""
        if math.isnan(self.value):
            return f"unstable from {self.limit.shows(self.limit.start)} on"
        words = "up to" if self.limit.end > self.limit.start else "down to"
        found = f"stable {words} {self.limit.shows(self.value)}"
        if self.reason:
            return f"{found}; beyond: {self.reason}"
        return found if self.reached else f"{found} and perhaps further"


def tolerance(diagram: Diagram, limit: Limit, at: float, engine: str = AUTO) -> Tolerance:
    """Search from the start of a range for the first value at which the loop is lost.

    The search first goes in ten steps, so it may miss an unstable stretch that is shorter than a step; then
    it uses Brent's method. AnalysisError if the loop cannot be analysed at the start; DiagramError if the
    diagram refuses a value.
    """
    excess = functools.cache(lambda value: _growth_at(diagram, limit, at, engine, value) - STABLE)
    if excess(limit.start) >= 0.0:
        return Tolerance(limit, math.nan)
    reasons: dict[float, str] = {}  # by value, why the loop cannot be analysed there

    def distance(value: float) -> float:
        try:
            return excess(value)
        except (AnalysisError, RunError) as error:
            reasons[value] = str(error)
            return 1.0

    grid = np.linspace(limit.start, limit.end, STEPS + 1).tolist()
    for before, after in pairwise(grid):
        if distance(after) >= 0.0:
            precision = PRECISION * abs(limit.end - limit.start)
            found = float(
                library("scipy.optimize").brentq(distance, before, after, xtol=precision, rtol=PRECISION)
            )
            return Tolerance(limit, found, reasons.get(after, ""))
    return Tolerance(limit, limit.end)


def _growth_at(diagram: Diagram, limit: Limit, at: float, engine: str, value: float) -> float:
    words = f"at {limit.shows(value)}, from {limit.shows(limit.start)} to {limit.shows(limit.end)}"
    with task(words):
        graph = varied(diagram, limit.variable.setting(value)).graph
        return growth(linearised(graph, (), at, engine))


class Limits(Mapping[str, Tolerance]):
    """The answers to all questions about limits, by name; each is computed when it is first read."""

    def __init__(self, diagram: Diagram, limits: Sequence[Limit], at: float, engine: str) -> None:
        self._diagram, self._at, self._engine = diagram, at, engine
        self._limits = {limit.label: limit for limit in limits}
        self._found: dict[Limit, Tolerance] = {}

    def __getitem__(self, label: str) -> Tolerance:
        return self.answer(self._limits[label])

    def answer(self, limit: Limit) -> Tolerance:
        """Return the answer to a question, also to one whose name another one took."""
        if limit not in self._found:
            with task(f"limit '{limit.label}'"):
                self._found[limit] = tolerance(self._diagram, limit, self._at, self._engine)
        return self._found[limit]

    def __iter__(self) -> Iterator[str]:
        return iter(self._limits)

    def __len__(self) -> int:
        return len(self._limits)
