"""`ports`: the inputs and outputs of a part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from quadvis.diagram.entries import named_entries
from quadvis.diagram.parameters import QUANTITY_KEYS, read_constant
from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.sections.forms import CONSTANT, TEXT, VALUES, Schema, closed, list_of, map_of, ref
from quadvis.diagram.sections.inputs import InputSpec, is_reference
from quadvis.diagram.sections.section import PART, FileSection
from quadvis.document import YamlMap, YamlNode, YamlScalar
from quadvis.errors import Faults, Place, Unknown

PORT_KEYS = ("in", "out")


@dataclass
class Ports:
    """The names of inputs, what some are if nothing is wired to them, and the sources of outputs."""

    inputs: dict[str, Place] = field(default_factory=dict)
    defaults: dict[str, InputSpec] = field(default_factory=dict)
    outputs: dict[str, Reference | Unknown] = field(default_factory=dict)


def _read_inputs(node: YamlNode, faults: Faults) -> Iterator[tuple[str, Place, InputSpec | None]]:
    """Yield the inputs: a name and its place, and the default if there is one."""
    for item in faults.collect(node.items) or []:
        if isinstance(item, YamlMap):
            for name, value in named_entries(item, "port", faults):
                yield name, value.place, InputSpec(value.place, faults.read(_read_default, value, faults))
        elif (plain := faults.collect(item.name)) is not None:
            yield plain, item.place, None


def _read_default(node: YamlNode, faults: Faults) -> YamlNode | Unknown:
    """Return a constant; its readers check kind, shape and unit."""
    is_quantity = isinstance(node, YamlMap) and any(key in node for key in QUANTITY_KEYS)
    is_text = isinstance(node, YamlScalar) and (not node.value or is_reference(node.value))
    if is_text or (isinstance(node, YamlMap) and not is_quantity):
        raise node.wrong("a constant", "write a value, such as '2 m' or 'true'")
    return read_constant(node, faults)


class PortsSection(FileSection[Ports]):
    """The ports of a part."""

    key = "ports"
    words = "of a part: `{in: [names, {name: default}], out: {name: block.port}}`, see below"
    kinds = (PART,)

    def read(self, node: YamlNode | None, faults: Faults) -> Ports:
        """Return the ports."""
        found = Ports()
        fields = faults.collect(node.fields, (), PORT_KEYS, faults) if node is not None else None
        if fields is None:
            return found
        for name, place, default in _read_inputs(fields["in"], faults) if "in" in fields else ():
            if name in found.inputs:
                problem = f"input '{name}' is already in line {found.inputs[name].line}"
                faults.add(place, problem, "keep one of them")
                continue
            found.inputs[name] = place
            if default is not None:
                found.defaults[name] = default
        for name, value in named_entries(fields.get("out"), "port", faults):
            found.outputs[name] = read_reference(value, faults)
        return found

    def schema(self) -> Schema:
        """Return the schema: names, and signals by name."""
        default = {"anyOf": [CONSTANT, *VALUES[1:]]}
        entry = {"anyOf": [TEXT, map_of(default, "a name, and what it is if nothing is wired to it")]}
        return closed(PORT_KEYS, {
            "in": list_of(entry, "names of what comes in; inside the part 'in.name'"),
            "out": map_of(ref("signal"), "what goes out"),
        })  # fmt: skip


PORTS = PortsSection()
