"""`blocks`: the blocks of a diagram or part, by name. The slots of a variant are read in the same way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from quadvis.block import Block
from quadvis.diagram.entries import PATH, refuse_name, with_clean_names
from quadvis.diagram.group import GROUP_KEY
from quadvis.diagram.sections.block_schema import BLOCK_KEYS, block_definitions
from quadvis.diagram.sections.block_text import resolved_block
from quadvis.diagram.sections.conditional import CONDITION_KEYS, PartCondition, read_condition
from quadvis.diagram.sections.forms import Schema, map_of, ref
from quadvis.diagram.sections.inputs import InputSpec, read_input
from quadvis.diagram.sections.section import DIAGRAM, PART, Checked, FileSection
from quadvis.document import YamlList, YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, closest, known

INSIDE = "in"  # the name of a part's inputs for its blocks


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
    runs: PartCondition | Unknown | None = None  # when it runs, if not always
    condition: tuple[str, Place] | Unknown | None = None  # the block that says when this one runs

    @property
    def constants(self) -> Iterator[YamlNode]:
        """The values at its inputs and in its conditions, which may name parameters."""
        for given in (*self.inputs.values(),) if self.inputs is not None and known(self.inputs) else ():
            yield from given.constants
        for signal in self.runs.signals if self.runs is not None and known(self.runs) else ():
            yield from signal.constants


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
        stream=faults.collect(_read_path, fields["stream"]) if "stream" in fields else None,
        groups=_read_groups(fields[GROUP_KEY]) if GROUP_KEY in fields else (),
        runs=read_condition(fields, faults) if any(key in fields for key in CONDITION_KEYS) else None,
        condition=faults.collect(_read_path, fields["condition"]) if "condition" in fields else None,
    )


def _read_name(node: YamlNode) -> tuple[str, Place]:
    return node.text(), node.place


def _read_path(node: YamlNode) -> tuple[str, Place]:
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
    return {port: read_input(value, faults) for port, value in wired.values.items()}


class BlocksSection(FileSection[Blocks]):
    """All blocks and parts of a file, by name."""

    key = "blocks"
    words = (
        "`name: {block: group.name, rate: ..., with: {parameters}, in: {inputs}}`, "
        "or `part: file.yaml` in place of `block`; `when`, `triggered`, `reset`, `initial` say when it runs, "
        "see below"
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
