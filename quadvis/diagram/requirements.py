"""What a diagram requires of a run, and what its summary shows: signals, stretches, limits.

Parts with several elements count element by element: the RMS of ``craft.position[0:2]`` is over both axes
together, its maximum the larger of the two, its final value one number for each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from quadvis.block import Shape
from quadvis.engine.graph import Index
from quadvis.engine.names import index_text
from quadvis.output.statistics import COUNT, Value
from quadvis.output.stretch import Sampling, Stretch
from quadvis.units import Unit

ONE = Unit()
WHOLE = Stretch(Sampling())


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

    def __str__(self) -> str:
        of = f" of {self.part.shows(self.part.of)}" if self.part.of else ""
        what = EXPECTATIONS[self.kind].words.format(limit=self.shows(self.limit), of=of)
        return " ".join(filter(None, (self.part.text, what, str(self.part.stretch))))

    def shows(self, value: float) -> str:
        """Return a limit, or what was found, for people."""
        return f"{value:g}" if self.statistic == COUNT else self.part.shows(value)


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
