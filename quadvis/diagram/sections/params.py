"""`params`: named values, which blocks and parts take as `$name`, and groups of them from other files."""

from __future__ import annotations

from quadvis.diagram.entries import named_entries
from quadvis.diagram.group import GROUP_KEY
from quadvis.diagram.parameters import named_parameters, read_constant
from quadvis.diagram.sections.forms import TEXT, Schema, closed, map_of, ref
from quadvis.diagram.sections.section import DIAGRAM, GROUP, PART, FileSection
from quadvis.document import YamlNode
from quadvis.errors import Faults, Unknown

Params = dict[str, YamlNode | Unknown]


class ParamsSection(FileSection[Params]):
    """The parameters of a diagram, part or group, by name."""

    key = "params"
    words = (
        "named values, used as `$name` or `$name[2]`; `quadvis run --set name=value` replaces them; "
        "`name: {group: file.yaml}` takes the values of a file, see below"
    )
    kinds = (DIAGRAM, PART, GROUP)

    def read(self, node: YamlNode | None, faults: Faults) -> Params:
        """Return the values with their units; those that name other parameters as they are written."""
        found: Params = {}
        for name, value in named_entries(node, "parameter", faults):
            with faults.about(f"parameter '{name}'"):
                found[name] = value if named_parameters(value) else read_constant(value, faults)
        return found

    def schema(self) -> Schema:
        """Return the schema: values by name."""
        file = {**TEXT, "description": "file of a group of parameters, relative to this one"}
        value = {"anyOf": [ref("value"), closed((GROUP_KEY,), {GROUP_KEY: file}, (GROUP_KEY,))]}
        return map_of(value, "named values, used as $name, $name[2], or $group.name")


PARAMS = ParamsSection()
