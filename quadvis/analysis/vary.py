"""How far a parameter can go before the loop is unstable: the diagram is loaded again for each value."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from quadvis.analysis.linearise import Linear, linearise
from quadvis.analysis.margins import growth
from quadvis.analysis.probe import AnalysisError, Probe, silence
from quadvis.diagram.analyse import Limit
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

STEPS = 12  # of the search for an unstable value
PRECISION = 1e-5  # of the value found, relative to it and to the range
STABLE = -1e-6  # 1/s; slower decay is none


@dataclass(frozen=True)
class Tolerance:
    """How far a parameter can go: the last stable ``value`` (SI).

    That is the end of the range if all of it is stable, and NaN if its start is not.
    """

    limit: Limit
    value: float

    @property
    def reached(self) -> bool:
        """Whether the loop becomes unstable in the range, or is from its start on."""
        return self.value != self.limit.end

    @property
    def text(self) -> str:
        """The answer in words."""
        if math.isnan(self.value):
            return f"unstable from {self.shows(self.limit.start)} on"
        words = "up to" if self.limit.end > self.limit.start else "down to"
        return f"stable {words} {self.shows(self.value)}{'' if self.reached else ' and perhaps further'}"

    def shows(self, value: float) -> str:
        """Return a value of the parameter for people."""
        unit = self.limit.shown
        number = f"{value / unit.scale:.4g}"
        return f"{number} {unit}" if unit.symbols else number


def tolerance(diagram: Diagram, limit: Limit, at: float) -> Tolerance:
    """Search from the start of a range for the first value at which the loop is unstable.

    Coarsely first, so an unstable stretch shorter than a twelfth of the range may be stepped over, then by
    Brent's method. AnalysisError if the diagram has no operating point on the way.
    """
    from scipy.optimize import brentq

    excess = functools.cache(lambda value: _growth_at(diagram, limit, at, value) - STABLE)
    if excess(limit.start) >= 0.0:
        return Tolerance(limit, math.nan)
    grid = np.linspace(limit.start, limit.end, STEPS + 1).tolist()
    for before, after in pairwise(grid):
        if excess(after) >= 0.0:
            precision = PRECISION * abs(limit.end - limit.start)
            return Tolerance(limit, float(brentq(excess, before, after, xtol=precision, rtol=PRECISION)))
    return Tolerance(limit, limit.end)


def _growth_at(diagram: Diagram, limit: Limit, at: float, value: float) -> float:
    setting = limit.variable.setting(value)
    try:
        return growth(linear_of(diagram.varied(setting), at))
    except QuadvisError as error:
        raise AnalysisError(f"{limit.label}, at {setting}: {error}") from error


def linear_of(diagram: Diagram, at: float) -> Linear:
    """Return a diagram's loop without cuts."""
    engine = Engine(diagram.graph)
    silence(engine)
    with engine:
        return linearise(Probe(engine, (), at))
