"""The JSON schema of diagrams, parts, groups and parameter files: completion, hover and checks in editors.

It is made from the declarations. An editor checks the form as one types; `quadvis check` knows more: units,
shapes, rates, loops.
"""

from __future__ import annotations

from collections.abc import Mapping

from quadvis.block import Block
from quadvis.diagram.keys import SECTIONS, keys
from quadvis.diagram.sections.base import BASE, WITHOUT
from quadvis.diagram.sections.forms import COMMON, Schema, closed
from quadvis.diagram.sections.header import FORMAT, NAME
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.sections.section import DIAGRAM, GROUP, PART
from quadvis.diagram.settings import PARAMETERS_KEYS, PARAMETERS_REQUIRED, parameters_schema


def diagram_schema(blocks: Mapping[str, type[Block]]) -> Schema:
    """Return the schema of all files, with the ports and parameters of the blocks, given by name."""
    top = {section.key: section.schema() for section in SECTIONS}
    definitions: dict[str, Schema] = dict(COMMON)
    for section in SECTIONS:
        definitions |= section.definitions(blocks)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "quadvis diagram",
        "type": "object",
        "if": {"required": ["set"]},
        "then": closed(
            (*PARAMETERS_REQUIRED, *PARAMETERS_KEYS), top | parameters_schema(), PARAMETERS_REQUIRED
        ),
        "else": {
            "if": _is_group(top),
            "then": _file(GROUP, top),
            "else": {
                "required": [FORMAT.key, NAME.key],
                # What a diagram must have may come from its base.
                "anyOf": [{"required": [BASE.key]}, {"required": list(keys(DIAGRAM, required=True))}],
                "dependentRequired": {WITHOUT.key: [BASE.key]},
                "if": {"required": [PORTS.key]},
                "then": _file(PART, top),
                "else": _file(DIAGRAM, top),
            },
        },
        "$defs": definitions,
    }


def _is_group(top: Mapping[str, Schema]) -> Schema:
    """Return what only groups fulfil: they have parameters, and none of the keys of other files."""
    own = {*keys(GROUP, required=True), *keys(GROUP, required=False)}
    others = [{"required": [key]} for key in top if key not in own]
    return {"required": [PARAMS.key], "not": {"anyOf": others}}


def _file(kind: str, top: Mapping[str, Schema]) -> Schema:
    return closed((*keys(kind, required=True), *keys(kind, required=False)), top)
