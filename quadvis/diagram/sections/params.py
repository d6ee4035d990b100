"""`params`: named values, which blocks and parts take as `$name`."""

from __future__ import annotations

from quadvis.diagram.entries import named_entries
from quadvis.diagram.sections.forms import Schema, map_of, ref
from quadvis.diagram.sections.section import DIAGRAM, PART, FileSection
from quadvis.diagram.values import read_constant
from quadvis.document import YamlNode
from quadvis.errors import Faults, Unknown

Params = dict[str, YamlNode | Unknown]


class ParamsSection(FileSection[Params]):
    """The parameters of a diagram or part, by name."""

    key = "params"
    words = "named values, used as `$name` or `$name[2]`; `quadvis run --set name=value` replaces them"
    kinds = (DIAGRAM, PART)

    def read(self, node: YamlNode | None, faults: Faults) -> Params:
        """Return the values with their units."""
        found: Params = {}
        for name, value in named_entries(node, "parameter", faults):
            with faults.about(f"parameter '{name}'"):
                found[name] = read_constant(value, faults)
        return found

    def schema(self) -> Schema:
        """Return the schema: values by name."""
        return map_of(ref("value"), "named values, used as $name or $name[2]")


PARAMS = ParamsSection()
