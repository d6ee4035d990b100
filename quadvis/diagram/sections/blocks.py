"""`blocks`: the blocks of a diagram or part, by name. The slots of a variant are read in the same way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from quadvis.block import Block
from quadvis.diagram.computed import is_computed
from quadvis.diagram.entries import PATH, refuse_name, with_clean_names
from quadvis.diagram.group import GROUP_KEY
from quadvis.diagram.parameters import QUANTITY_KEYS
from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.sections.block_schema import BLOCK_KEYS, WIRE_KEYS, block_definitions
from quadvis.diagram.sections.block_text import resolved_block
from quadvis.diagram.sections.forms import Schema, map_of, ref
from quadvis.diagram.sections.section import DIAGRAM, PART, Checked, FileSection
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, closest, known
from quadvis.graph.graph import CROSSINGS
from quadvis.units import plain_text

INSIDE = "in"  # the name of a part's inputs for its blocks


class InputSpec(NamedTuple):
    """The source of an input: a signal or a constant, and how it crosses between rates and computers.

    For an input of any number, a list of signals is a tuple of their sources.
    """

    place: Place
    source: Reference | YamlNode | Unknown | tuple[InputSpec, ...]
    across: str | Unknown | None = None
    across_place: Place | None = None
    over: YamlNode | None = None
    initial: YamlNode | None = None

    @property
    def entries(self) -> tuple[InputSpec, ...]:
        """What an input of any number takes: each entry of a list, or the one source that is written."""
        if isinstance(self.source, YamlList):
            return tuple(InputSpec(node.place, node) for node in self.source.items())
        return self.source if isinstance(self.source, tuple) else (self,)

    @property
    def constants(self) -> tuple[YamlNode, ...]:
        """The values in it, which may name parameters."""
        if isinstance(self.source, tuple):
            return tuple(value for entry in self.source for value in entry.constants)
        own = (self.source,) if isinstance(self.source, YamlNode) else ()
        return own if self.initial is None else (*own, self.initial)


class BlockSpec(NamedTuple):
    """One entry under ``blocks``: a block of the catalogue, or a part from a file."""

    name: str
    place: Place
    kind: str
    kind_place: Place
    is_part: bool
    parameters: dict[str, YamlNode] | Unknown
    parameter_places: dict[str, Place]
    groups: tuple[YamlNode, ...] = ()  # from which it takes parameters: `$name`
    rate: tuple[str, Place] | Unknown | None = None
    at: tuple[str, Place] | Unknown | None = None  # the computer that runs it, or its inner blocks
    slot: Place | Unknown | None = None
    inputs: dict[str, InputSpec] | Unknown | None = None  # None: no 'in' was written
    stream: tuple[str, Place] | None = None  # the name of its noise, or of that of its inner blocks
    inherits: bool = False  # whether the inputs are those of the block that it replaces


Blocks = dict[str, BlockSpec | Unknown]


def read_block(name: str, place: Place, node: YamlNode, faults: Faults) -> BlockSpec | Unknown:
    """Read one entry under ``blocks`` or under a variant's ``slots``."""
    fields = faults.collect(node.fields, (), BLOCK_KEYS, faults)
    if fields is None:
        return UNKNOWN
    kinds = [fields[key] for key in ("block", "part") if key in fields]
    kind = faults.collect(kinds[0].text) if len(kinds) == 1 else None
    given = faults.read(with_clean_names, fields["with"], faults) if "with" in fields else None
    inputs = _read_inputs(fields["in"], faults) if "in" in fields else None
    doubled = {closest(key, BLOCK_KEYS) for key in fields if key not in BLOCK_KEYS}
    if len(kinds) != 1 and not doubled & {"block", "part"}:
        problem = "both 'block' and 'part' are given" if kinds else "neither 'block' nor 'part' is given"
        faults.add(place, problem, "give 'block: group.name' or 'part: file.yaml'")
    if kind is None:
        return UNKNOWN
    return BlockSpec(
        name,
        place,
        kind,
        kinds[0].place,
        is_part="part" in fields,
        rate=faults.read(_read_name, fields["rate"]) if "rate" in fields else None,
        at=faults.read(_read_name, fields["at"]) if "at" in fields else None,
        slot=_read_slot(fields["slot"], faults) if "slot" in fields else None,
        parameters=UNKNOWN if given is UNKNOWN or "with" in doubled else given.values if given else {},
        parameter_places=_places(given) if given is not None and known(given) else {},
        inputs=UNKNOWN if "in" in doubled else inputs,
        stream=faults.collect(_read_stream, fields["stream"]) if "stream" in fields else None,
        groups=_read_groups(fields[GROUP_KEY]) if GROUP_KEY in fields else (),
    )


def _read_name(node: YamlNode) -> tuple[str, Place]:
    return node.text(), node.place


def _read_stream(node: YamlNode) -> tuple[str, Place]:
    if PATH.fullmatch(node.text()) is None:
        raise node.wrong("a name, or names joined by '/'")
    return node.text(), node.place


def _read_groups(node: YamlNode) -> tuple[YamlNode, ...]:
    """Return the names of one group, or of a list of them."""
    return tuple(node.items()) if isinstance(node, YamlList) else (node,)


def _read_slot(node: YamlNode, faults: Faults) -> Place | Unknown | None:
    is_slot = faults.read(node.boolean)
    return UNKNOWN if is_slot is UNKNOWN else node.place if is_slot else None


def _places(given: YamlMap) -> dict[str, Place]:
    return {key: node.place for key, node in given.keys.items()}


def _read_inputs(node: YamlNode, faults: Faults) -> dict[str, InputSpec] | Unknown:
    wired = faults.collect(with_clean_names, node, faults)
    if wired is None:
        return UNKNOWN
    return {port: _read_input(value, faults) for port, value in wired.values.items()}


def _read_input(node: YamlNode, faults: Faults) -> InputSpec:
    """Read ``block.port``, ``{from: block.port, across: hold}``, ``1 m`` or ``{value: ..., unit: ...}``.

    A list with a signal in it is one for an input of any number; a list of constants may be an array.
    """
    if isinstance(node, YamlList) and any(_names_signal(item) for item in node):
        return InputSpec(node.place, tuple(_read_input(item, faults) for item in node))
    is_value = isinstance(node, YamlMap) and any(key in node for key in QUANTITY_KEYS)
    if isinstance(node, YamlMap) and is_value and "from" in node:
        faults.add(node.place, "a signal and a value are given at once", "keep 'from' or 'value'")
        return InputSpec(node.place, UNKNOWN)
    if isinstance(node, YamlMap) and not is_value:
        node = node.fields(WIRE_KEYS[:1], WIRE_KEYS[1:], faults)
        source = read_reference(node["from"], faults) if "from" in node else UNKNOWN
        across = node.get("across")
        if across is not None:
            crossing: str | Unknown | None = faults.read(across.choice, CROSSINGS)
        else:
            crossing = UNKNOWN if not {*node} <= {*WIRE_KEYS} else None  # under a key that is wrong
        place = across.place if across is not None else None
        return InputSpec(node.place, source, crossing, place, node.get("over"), node.get("initial"))
    if isinstance(node, YamlScalar) and is_reference(node.value):
        return InputSpec(node.place, read_reference(node, faults))
    return InputSpec(node.place, node)


def _names_signal(node: YamlNode) -> bool:
    """Say whether an entry of a list is meant as a signal."""
    if isinstance(node, YamlMap):
        return not any(key in node for key in QUANTITY_KEYS)
    return isinstance(node, YamlScalar) and is_reference(node.value)


def is_reference(text: str) -> bool:
    """Say whether an input's text is meant as a signal: no number, truth value, ``$name`` or arithmetic."""
    is_name = (text[:1].isalpha() or text[:1] == "_") and text not in ("true", "false")
    if not is_name or not ("$" in text or "(" in text or text.startswith("pi")):
        return is_name
    return not is_computed(text) and plain_text(text) == text


class BlocksSection(FileSection[Blocks]):
    """All blocks and parts of a file, by name."""

    key = "blocks"
    words = (
        "`name: {block: group.name, rate: ..., with: {parameters}, in: {inputs}}`, "
        "or `part: file.yaml` in place of `block`"
    )
    required = True
    kinds = (DIAGRAM, PART)

    def read(self, node: YamlNode | None, faults: Faults) -> Blocks:
        """Return the entries in the order of the file."""
        found: Blocks = {}
        mapping = faults.collect(with_clean_names, node, faults) if node is not None else None
        if mapping is None:
            return found
        if not mapping.values:
            remedy = "add one, such as 'source: {block: sources.sine, rate: fast}'"
            faults.add(mapping.place, "there are no blocks", remedy)
        for name, value in mapping.values.items():
            key = mapping.keys[name]
            with faults.about(f"block '{name}'"):
                if name == INSIDE:
                    faults.add(key.place, "no block can be called 'in'", "'in' names the inputs of a part")
                elif PATH.fullmatch(name) is None:
                    refuse_name(key, "block", faults)
                found[name] = read_block(name, Place(key.file, key.line, key.column), value, faults)
        return found

    def schema(self) -> Schema:
        """Return the schema: blocks by name."""
        return map_of(ref("block"), "all blocks by name")

    def definitions(self, blocks: Mapping[str, type[Block]]) -> Mapping[str, Schema]:
        """Return the forms of blocks and of their inputs."""
        return block_definitions(blocks)

    def resolved(self, diagram: Checked) -> Any:
        """Return all blocks, with every parameter."""
        nodes = {node.path: node for node in diagram.graph.nodes}
        return {
            path: resolved_block(node, diagram.path.parent, nodes)
            for path, node in nodes.items()
            if not node.origin
        }


BLOCKS = BlocksSection()
