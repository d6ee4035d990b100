"""Other times: all rates of a diagram scaled together, as xPC's SampleTime does; another stop time."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.rewritten import rewritten, written_out
from quadvis.diagram.times import read_duration
from quadvis.document import YamlScalar
from quadvis.errors import DiagramError


def rescaled(diagram: Diagram, sample_time: float) -> Diagram:
    """Return a diagram with another base tick (s); QuadvisError if it cannot be.

    The periods of all rates and the step of the solver keep their ratios. The parameters stay: numbers that
    were worked out for a rate, such as a coefficient of a filter, are not worked out again.
    """
    written = written_out(diagram)
    factor = _exact(sample_time) / diagram.graph.tick
    written["rates"] = {name: _scaled(text, factor) for name, text in written.get("rates", {}).items()}
    solver = written.get("solver")
    if isinstance(solver, dict) and "step" in solver:
        solver["step"] = _scaled(solver["step"], factor)
    return rewritten(diagram, written)


def lasting(diagram: Diagram, stop_time: float) -> Diagram | None:
    """Return a diagram with another stop time (s); None if what it expects does not fit this time."""
    written = written_out(diagram)
    written["stop_time"] = f"{_exact(stop_time)} s"
    try:
        return rewritten(diagram, written)
    except DiagramError:
        return None


def _exact(time: float) -> Fraction:
    """Return a time as it is written: 0.1 s is 1/10 s."""
    return Fraction(repr(float(time)))


def _scaled(entry: Any, factor: Fraction) -> Any:
    """Return the entry of a rate, a period or one with an offset, with its times scaled."""
    if isinstance(entry, dict):
        return {key: _scaled(value, factor) for key, value in entry.items()}
    return f"{read_duration(YamlScalar(str(entry), False, 'rates', 0, 0)) * factor} s"
