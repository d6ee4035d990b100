"""`on_host_loss`: what a real-time run does when the process that has started it dies."""

from __future__ import annotations

from typing import Any

from quadvis.diagram.sections.forms import Schema
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.document import YamlNode
from quadvis.errors import Faults

CONTINUE, SAFE, STOP = CHOICES = ("continue", "safe", "stop")


class OnHostLoss(FileSection[str]):
    """What the loss of the host means for the outputs."""

    key = "on_host_loss"
    words = (
        "what the death of the command means for the outputs of a real-time run: `safe` (default): safe "
        "values at once, then the loops end; `stop`: the loops end before their next steps, then safe "
        "values; `continue`: the loops go on to the stop time"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> str:
        """Return the word."""
        return (faults.collect(node.choice, CHOICES) if node is not None else None) or SAFE

    def schema(self) -> Schema:
        """Return the schema: one of three words."""
        return {"enum": list(CHOICES), "description": "what a real-time run does without its command"}

    def resolved(self, diagram: Checked) -> Any:
        """Return the word if it is not the default, so that the hashes of other diagrams stay the same."""
        word = diagram.values[self]
        return None if word == SAFE else word


ON_HOST_LOSS = OnHostLoss()
