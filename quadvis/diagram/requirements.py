"""The requirements of a diagram on a run, and the lines of its summary: signals, stretches, limits.

Selections with several elements count element by element: the RMS of ``craft.position[0:2]`` is over both
axes together, its maximum is the larger of the two, its final value is one number for each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from quadvis.block import Shape
from quadvis.graph.graph import Index
from quadvis.graph.names import index_text
from quadvis.output.statistics import COUNT, Value
from quadvis.output.stretch import Sampling, Stretch
from quadvis.units import Unit

ONE = Unit()
WHOLE = Stretch(Sampling())


@dataclass(frozen=True)
class Selection:
    """Elements of a signal over a stretch of the run; they are judged by their distance from ``of``.

    ``shape`` is the shape of the whole signal. ``unit`` is the unit of the elements, ``shown`` the unit of
    texts.
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
        """The elements as a diagram writes them, "[0]" or "[2,1]"; "" for a scalar."""
        places = np.arange(math.prod(self.shape)).reshape(self.shape)[self.index].ravel().tolist()
        if len(places) == 1:
            return ("",)
        return tuple(index_text(tuple(map(int, np.unravel_index(place, self.shape)))) for place in places)

    def scaled(self, value: float) -> float:
        """Return a value of the elements in the unit of texts."""
        return value * self.unit.scale / self.shown.scale

    def shows(self, value: Value) -> str:
        """Return a value of the elements as text; several elements are all listed."""
        if isinstance(value, tuple):
            number = f"({', '.join(f'{self.scaled(each):.4g}' for each in value)})"
        else:
            number = f"{self.scaled(value):.4g}"
        return f"{number} {self.shown}" if self.shown.symbols else number


class Criterion(NamedTuple):
    """A criterion for samples: the statistic, its comparison with the limit, and the words for it."""

    statistic: str
    holds: Callable[[float, float], bool]
    words: str


EXPECTATIONS: Mapping[str, Criterion] = {
    "within": Criterion("max", lambda found, limit: found <= limit, "within {limit}{of}"),
    "rms": Criterion("rms", lambda found, limit: found <= limit, "rms at most {limit}{of}"),
    "below": Criterion("highest", lambda found, limit: found < limit, "always below {limit}{of}"),
    "above": Criterion("lowest", lambda found, limit: found > limit, "always above {limit}{of}"),
    "count": Criterion(COUNT, lambda found, limit: found <= limit, "true at most {limit} times"),
    "at_least": Criterion(COUNT, lambda found, limit: found >= limit, "true at least {limit} times"),
}


class Expectation(NamedTuple):
    """One requirement on a run: ``kind`` is a key of EXPECTATIONS, ``limit`` in the unit of the elements."""

    selection: Selection
    kind: str
    limit: float

    @property
    def statistic(self) -> str:
        """The name of the statistic that is compared with the limit."""
        return EXPECTATIONS[self.kind].statistic

    def __str__(self) -> str:
        of = f" of {self.selection.shows(self.selection.of)}" if self.selection.of else ""
        what = EXPECTATIONS[self.kind].words.format(limit=self.shows(self.limit), of=of)
        return " ".join(filter(None, (self.selection.text, what, str(self.selection.stretch))))

    def shows(self, value: float) -> str:
        """Return a limit, or a value that was found, as text."""
        return f"{value:g}" if self.statistic == COUNT else self.selection.shows(value)


class Entry(NamedTuple):
    """A line of the summary: statistics of a selection."""

    label: str
    selection: Selection
    show: tuple[str, ...]

    def shows(self, name: str, value: Value) -> str:
        """Return one of the statistics as text."""
        if isinstance(value, float) and math.isnan(value):
            return "none"
        return f"{value:g}" if name == COUNT else self.selection.shows(value)
