"""The vocabulary of JSON schemas: objects with known keys, maps, lists, and the forms of values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from quadvis.diagram.matrices import FILE_KEYS
from quadvis.diagram.parameters import QUANTITY_KEYS
from quadvis.graph.names import PATTERN

Schema = dict[str, Any]

TEXT: Schema = {"type": ["string", "number", "boolean"]}  # any scalar is a text where one is wanted
QUANTITY: Schema = {"type": ["string", "number"]}
CONSTANT: Schema = {
    "anyOf": [{"type": "number"}, {"type": "string", "pattern": r"^([-+.$(\d]|pi\b|[A-Za-z]\w*\()"}]
}
NAME: Schema = {"pattern": "^[A-Za-z_][A-Za-z0-9_/]*$"}
SIGNAL: Schema = {**TEXT, "pattern": f"^{PATTERN}$", "description": "block.port"}


def closed(keys: Iterable[str], properties: Mapping[str, Schema], required: Iterable[str] = ()) -> Schema:
    """Return an object that has these keys and no others."""
    found: Schema = {"type": "object", "properties": {key: properties[key] for key in keys}}
    found["additionalProperties"] = False
    if required:
        found["required"] = list(required)
    return found


def map_of(value: Schema, words: str) -> Schema:
    """Return a map from names to values of one form."""
    return {"type": "object", "propertyNames": NAME, "additionalProperties": value, "description": words}


def labelled(value: Schema, words: str) -> Schema:
    """Return a map from any texts to values of one form."""
    return {"type": "object", "additionalProperties": value, "description": words}


def list_of(value: Schema, words: str) -> Schema:
    """Return a list of values of one form."""
    return {"type": "array", "items": value, "description": words}


def ref(name: str) -> Schema:
    """Return a reference to a definition."""
    return {"$ref": f"#/$defs/{name}"}


VALUES: tuple[Schema, ...] = (
    QUANTITY,
    {"type": "boolean"},
    {"type": "array"},
    closed(QUANTITY_KEYS, {"value": {}, "unit": TEXT}, ["value"]),
    closed(
        FILE_KEYS,
        {
            "file": {**TEXT, "description": "file of a matrix: .csv, .npy, .npz, .mat or .yaml"},
            "name": {**TEXT, "description": "which array of the file"},
            "unit": TEXT,
        },
        ["file"],
    ),
)
COMMON: Mapping[str, Schema] = {"signal": SIGNAL, "value": {"anyOf": list(VALUES)}}  # what all may refer to
