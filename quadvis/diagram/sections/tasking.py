"""`tasking`: one order of execution a tick, or each rate by itself."""

from __future__ import annotations

from typing import Any

from quadvis.diagram.sections.forms import Schema
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.document import YamlNode
from quadvis.errors import Faults
from quadvis.graph.graph import SINGLE, TASKINGS


class Tasking(FileSection[str]):
    """How the tasks of a diagram share the processor; words and meaning are Simulink's."""

    key = "tasking"
    words = (
        "`single` (default): all blocks that are due run in one order; `multi`: rate by rate, the fastest "
        "first, with deterministic transitions between them"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> str:
        """Return ``single`` or ``multi``."""
        return (faults.collect(node.choice, TASKINGS) if node is not None else None) or SINGLE

    def schema(self) -> Schema:
        """Return the schema: one of two words."""
        return {"enum": list(TASKINGS), "description": "how tasks share the processor, as in Simulink"}

    def resolved(self, diagram: Checked) -> Any:
        """Return the word if it is not the default, so that the hashes of other diagrams stay the same."""
        tasking = diagram.graph.tasking
        return None if tasking == SINGLE else tasking


TASKING = Tasking()
