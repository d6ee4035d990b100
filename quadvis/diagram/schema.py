"""The JSON schema of diagrams, parts and parameter files: completion, hover and checks in editors.

It is made from the declarations. An editor checks the form as one types; `quadvis check` knows more: units,
shapes, rates, loops.
"""

from __future__ import annotations

from collections.abc import Mapping

from quadvis.block import Block
from quadvis.diagram.keys import SECTIONS, keys
from quadvis.diagram.sections.forms import COMMON, Schema, closed
from quadvis.diagram.sections.section import DIAGRAM, PART
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
            "required": list(keys(DIAGRAM, required=True)),
            "if": {"required": ["ports"]},
            "then": _file(PART, top),
            "else": _file(DIAGRAM, top),
        },
        "$defs": definitions,
    }


def _file(kind: str, top: Mapping[str, Schema]) -> Schema:
    return closed((*keys(kind, required=True), *keys(kind, required=False)), top)
