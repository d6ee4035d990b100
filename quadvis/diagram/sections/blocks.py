"""`blocks`: what a diagram or part is made of, by name. The slots of a variant are read likewise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from quadvis.block import Block
from quadvis.diagram.entries import PATH, refuse_name, with_clean_names
from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.sections.block_schema import BLOCK_KEYS, WIRE_KEYS, block_definitions
from quadvis.diagram.sections.block_text import resolved_block
from quadvis.diagram.sections.forms import Schema, map_of, ref
from quadvis.diagram.sections.section import DIAGRAM, PART, Checked, FileSection
from quadvis.diagram.values import QUANTITY_KEYS
from quadvis.document import YamlMap, YamlNode, YamlScalar
from quadvis.engine.graph import CROSSINGS, TOLD
from quadvis.errors import Faults, Place, closest

INSIDE = "in"  # the name under which a part's blocks see what comes in


@dataclass(frozen=True)
class InputSpec:
    """What an input is given: a signal or a constant, and how the wire crosses between rates."""

    place: Place
    source: Reference | YamlNode | None  # None: what is wrong has been told
    across: str | None = None
    across_place: Place | None = None


@dataclass(frozen=True)
class BlockSpec:
    """One entry under ``blocks``: a block of the catalogue, or a part from a file."""

    name: str
    place: Place
    kind: str
    kind_place: Place
    is_part: bool
    rate: tuple[str, Place] | None = None
    slot: Place | None = None
    parameters: dict[str, YamlNode] = field(default_factory=dict)
    parameter_places: dict[str, Place] = field(default_factory=dict)
    inputs: dict[str, InputSpec] | None = None  # None: no 'in' was written
    told: frozenset[str] = frozenset()  # keys that are wrong or misspelt: what they lack is no news


Blocks = dict[str, BlockSpec | None]  # None: an entry that could not be read, which has been reported


def read_block(name: str, place: Place, node: YamlNode, faults: Faults) -> BlockSpec | None:
    """Read one entry under ``blocks`` or under a variant's ``slots``; None if it does not say what it is."""
    fields = faults.collect(node.fields, (), BLOCK_KEYS, faults)
    if fields is None:
        return None
    told = {closest(key, BLOCK_KEYS) or "" for key in fields if key not in BLOCK_KEYS}
    kinds = [fields[key] for key in ("block", "part") if key in fields]
    kind = faults.collect(kinds[0].text) if len(kinds) == 1 else None
    given = faults.collect(with_clean_names, fields["with"], faults) if "with" in fields else None
    wired = faults.collect(with_clean_names, fields["in"], faults) if "in" in fields else None
    inputs = {port: _read_input(value, faults) for port, value in (wired.values if wired else {}).items()}
    rate = faults.collect(fields["rate"].text) if "rate" in fields else None
    is_slot = faults.collect(fields["slot"].boolean) if "slot" in fields else False
    if len(kinds) != 1 and not told & {"block", "part"}:
        problem = "both 'block' and 'part' are given" if kinds else "neither 'block' nor 'part' is given"
        faults.add(place, problem, "give 'block: group.name' or 'part: file.yaml'")
    if kind is None:
        return None
    read = {"rate": rate, "with": given, "in": wired, "slot": is_slot}
    told |= {key for key, value in read.items() if key in fields and value is None}
    return BlockSpec(
        name,
        place,
        kind,
        kinds[0].place,
        is_part="part" in fields,
        rate=(rate, fields["rate"].place) if rate is not None else None,
        slot=fields["slot"].place if is_slot else None,
        parameters=given.values if given is not None else {},
        parameter_places={key: node.place for key, node in given.keys.items()} if given is not None else {},
        inputs=inputs if "in" in fields else None,
        told=frozenset(told),
    )


def _read_input(node: YamlNode, faults: Faults) -> InputSpec:
    """Read ``block.port``, ``{from: block.port, across: hold}``, ``1 m`` or ``{value: ..., unit: ...}``."""
    is_value = isinstance(node, YamlMap) and any(key in node for key in QUANTITY_KEYS)
    if isinstance(node, YamlMap) and is_value and "from" in node:
        faults.add(node.place, "a signal and a value are given at once", "keep 'from' or 'value'")
        return InputSpec(node.place, None)
    if isinstance(node, YamlMap) and not is_value:
        node = node.fields(WIRE_KEYS[:1], WIRE_KEYS[1:], faults)
        source = read_reference(node["from"], faults) if "from" in node else None
        across = node.get("across")
        crossing = faults.collect(across.choice, CROSSINGS) if across is not None else None
        if crossing is None and len(node) > 1:
            crossing = TOLD
        return InputSpec(node.place, source, crossing, across.place if across is not None else None)
    if isinstance(node, YamlScalar) and _is_reference(node.value):
        return InputSpec(node.place, read_reference(node, faults))
    return InputSpec(node.place, node)


def _is_reference(text: str) -> bool:
    """Say whether an input's text is meant as a signal: no number, truth value or ``$name``."""
    return (text[:1].isalpha() or text[:1] == "_") and text not in ("true", "false")


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
        return {node.path: resolved_block(node, diagram.path.parent) for node in diagram.graph.nodes}


BLOCKS = BlocksSection()
