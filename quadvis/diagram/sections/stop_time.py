"""`stop_time`: how long a run is."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

from quadvis.diagram.parameters import named_parameters
from quadvis.diagram.sections.forms import QUANTITY, Schema
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.diagram.times import read_duration
from quadvis.document import YamlNode
from quadvis.errors import Faults, Unknown


class OpenTime(NamedTuple):
    """A time that names parameters, until `timing` reads it."""

    node: YamlNode


class StopTime(FileSection[Fraction | Unknown | OpenTime | None]):
    """The length of a run (s); None where it is not written."""

    key = "stop_time"
    words = "how long a run is, or a parameter, `$name`"

    def read(self, node: YamlNode | None, faults: Faults) -> Fraction | Unknown | OpenTime | None:
        """Return the time."""
        if node is not None and named_parameters(node):
            return OpenTime(node)
        return faults.read(read_duration, node) if node is not None else None

    def schema(self) -> Schema:
        """Return the schema: a time."""
        return {**QUANTITY, "description": "length of a run, such as 20 s"}

    def resolved(self, diagram: Checked) -> str:
        """Return the length of a run, also if it was replaced from outside."""
        return f"{diagram.stop_time} s"


STOP_TIME = StopTime()
