"""A diagram with other times: its resolved form, changed and loaded again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import yaml

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.load import load_text
from quadvis.document import dump_yaml


def written_out(diagram: Diagram) -> dict[str, Any]:
    """Return the resolved diagram as plain data, to be changed."""
    written: dict[str, Any] = yaml.safe_load(diagram.resolved)
    return written


def rewritten(diagram: Diagram, written: dict[str, Any]) -> Diagram:
    """Return the diagram that the changed data say; DiagramError if they have a fault."""
    found = load_text(dump_yaml(written), diagram.path.parent, diagram.path.name, diagram.own_blocks)
    return replace(found, ports=diagram.ports, knobs=diagram.knobs, here=diagram.here)


def refined(diagram: Diagram, factor: int) -> Diagram:
    """Return a diagram with a solver step so many times smaller; it must have one."""
    written = written_out(diagram)
    assert diagram.graph.step is not None
    written["solver"]["step"] = f"{diagram.graph.step / factor} s"
    return rewritten(diagram, written)
