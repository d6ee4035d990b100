"""`ports`: the inputs and outputs of a part."""

from __future__ import annotations

from dataclasses import dataclass, field

from quadvis.diagram.entries import named_entries
from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.sections.forms import TEXT, Schema, closed, list_of, map_of, ref
from quadvis.diagram.sections.section import PART, FileSection
from quadvis.document import YamlNode
from quadvis.errors import Faults, Place, Unknown

PORT_KEYS = ("in", "out")


@dataclass
class Ports:
    """The names of inputs, and the sources of outputs."""

    inputs: dict[str, Place] = field(default_factory=dict)
    outputs: dict[str, Reference | Unknown] = field(default_factory=dict)


class PortsSection(FileSection[Ports]):
    """The ports of a part."""

    key = "ports"
    words = "of a part: `{in: [names], out: {name: block.port}}`, see below"
    kinds = (PART,)

    def read(self, node: YamlNode | None, faults: Faults) -> Ports:
        """Return the ports."""
        found = Ports()
        fields = faults.collect(node.fields, (), PORT_KEYS, faults) if node is not None else None
        if fields is None:
            return found
        for item in (faults.collect(fields["in"].items) if "in" in fields else None) or []:
            name = faults.collect(item.name)
            if name is not None and name in found.inputs:
                problem = f"input '{name}' is already in line {found.inputs[name].line}"
                faults.add(item.place, problem, "keep one of them")
            elif name is not None:
                found.inputs[name] = item.place
        for name, value in named_entries(fields.get("out"), "port", faults):
            found.outputs[name] = read_reference(value, faults)
        return found

    def schema(self) -> Schema:
        """Return the schema: names, and signals by name."""
        return closed(PORT_KEYS, {
            "in": list_of(TEXT, "names of what comes in; inside the part 'in.name'"),
            "out": map_of(ref("signal"), "what goes out"),
        })  # fmt: skip


PORTS = PortsSection()
