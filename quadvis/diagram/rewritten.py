"""A diagram with other times: its resolved form, changed and loaded again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import yaml

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.load import load_text
from quadvis.diagram.sections.solver import LEAST
from quadvis.document import dump_yaml
from quadvis.graph.graph import VARIABLE


def written_out(diagram: Diagram) -> dict[str, Any]:
    """Return the resolved diagram as plain data, to be changed."""
    written: dict[str, Any] = yaml.safe_load(diagram.resolved)
    return written


def rewritten(diagram: Diagram, written: dict[str, Any]) -> Diagram:
    """Return the diagram that the changed data say; DiagramError if they have a fault."""
    found = load_text(dump_yaml(written), diagram.path.parent, diagram.path.name, diagram.own_blocks)
    return replace(found, ports=diagram.ports, knobs=diagram.knobs, here=diagram.here)


def refined(diagram: Diagram, times: int) -> Diagram:
    """Return a diagram with a solver step halved so many times; it must have one.

    Of a solver that chooses its steps the tolerances are made a tenth as often.
    """
    written, graph = written_out(diagram), diagram.graph
    assert graph.step is not None
    if graph.solver in VARIABLE:
        rtol, atol = graph.tolerances
        written["solver"]["rtol"] = max(LEAST, rtol / 10**times)
        written["solver"]["atol"] = atol / 10**times
    else:
        written["solver"]["step"] = f"{graph.step / 2**times} s"
    return rewritten(diagram, written)
