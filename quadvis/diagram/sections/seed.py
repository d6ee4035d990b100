"""`seed`: the seed of all noise."""

from __future__ import annotations

from quadvis.diagram.sections.forms import Schema
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.document import YamlNode
from quadvis.errors import Faults


class Seed(FileSection[int]):
    """The seed of all noise; 0 where it is not written."""

    key = "seed"
    words = "the seed of all its noise"

    def read(self, node: YamlNode | None, faults: Faults) -> int:
        """Return the number."""
        return (faults.collect(node.integer) if node is not None else None) or 0

    def schema(self) -> Schema:
        """Return the schema: a whole number."""
        return {"type": "integer", "description": "seed of all noise"}

    def resolved(self, diagram: Checked) -> int:
        """Return the seed, also if it was replaced from outside."""
        return diagram.seed


SEED = Seed()
