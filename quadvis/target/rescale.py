"""Other times: all rates of a diagram scaled together, as xPC's SampleTime does; another stop time."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import yaml

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.load import load_text
from quadvis.diagram.times import read_duration
from quadvis.document import YamlScalar, dump_yaml
from quadvis.errors import DiagramError


def rescaled(diagram: Diagram, sample_time: float) -> Diagram:
    """Return a diagram with another base tick (s); QuadvisError if it cannot be.

    The periods of all rates and the step of the solver keep their ratios. The parameters stay: numbers that
    were worked out for a rate, such as a coefficient of a filter, are not worked out again.
    """
    written: dict[str, Any] = yaml.safe_load(diagram.resolved)
    factor = _exact(sample_time) / diagram.graph.tick
    written["rates"] = {name: _scaled(text, factor) for name, text in written.get("rates", {}).items()}
    solver = written.get("solver")
    if isinstance(solver, dict) and "step" in solver:
        solver["step"] = _scaled(solver["step"], factor)
    return _read(written, diagram)


def lasting(diagram: Diagram, stop_time: float) -> Diagram | None:
    """Return a diagram with another stop time (s); None if what it expects does not fit this time."""
    written: dict[str, Any] = yaml.safe_load(diagram.resolved)
    written["stop_time"] = f"{_exact(stop_time)} s"
    try:
        return _read(written, diagram)
    except DiagramError:
        return None


def _read(written: dict[str, Any], diagram: Diagram) -> Diagram:
    found = load_text(dump_yaml(written), diagram.path.parent, diagram.path.name, diagram.own_blocks)
    return replace(found, ports=diagram.ports, knobs=diagram.knobs, here=diagram.here)


def _exact(time: float) -> Fraction:
    """Return a time as it is written: 0.1 s is 1/10 s."""
    return Fraction(repr(float(time)))


def _scaled(entry: Any, factor: Fraction) -> Any:
    """Return the entry of a rate, a period or one with an offset, with its times scaled."""
    if isinstance(entry, dict):
        return {key: _scaled(value, factor) for key, value in entry.items()}
    return f"{read_duration(YamlScalar(str(entry), False, 'rates', 0, 0)) * factor} s"
