"""Another sample time: all rates of a diagram scaled together, as xPC's SampleTime does."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import yaml

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.load import load_text
from quadvis.diagram.times import read_duration
from quadvis.document import YamlScalar, dump_yaml
from quadvis.errors import QuadvisError


def rescaled(diagram: Diagram, sample_time: str) -> Diagram:
    """Return a diagram whose base tick is another one, such as "2 ms"; QuadvisError if it cannot be.

    The periods of all rates and the step of the solver keep their ratios. The parameters stay: numbers that
    were worked out for a rate, such as a coefficient of a filter, are not worked out again.
    """
    wanted = read_duration(YamlScalar(sample_time, False, "SampleTime", 0, 0))
    if wanted <= 0:
        raise QuadvisError("the sample time must be above 0 s")
    factor = wanted / diagram.graph.tick
    written: dict[str, Any] = yaml.safe_load(diagram.resolved)
    written["rates"] = {name: _scaled(text, factor) for name, text in written.get("rates", {}).items()}
    solver = written.get("solver")
    if isinstance(solver, dict) and "step" in solver:
        solver["step"] = _scaled(solver["step"], factor)
    return load_text(dump_yaml(written), diagram.path.parent, diagram.path.name, diagram.own_blocks)


def _scaled(entry: Any, factor: Fraction) -> Any:
    """Return the entry of a rate, a period or one with an offset, with its times scaled."""
    if isinstance(entry, dict):
        return {key: _scaled(value, factor) for key, value in entry.items()}
    return f"{read_duration(YamlScalar(str(entry), False, 'rates', 0, 0)) * factor} s"
