"""Lists of names that are taken away, by section: what `without` says, of a base or in a variant."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from quadvis.diagram.sections.forms import TEXT, Schema, closed, list_of
from quadvis.document import YamlNode
from quadvis.errors import Faults, Place

Without = dict[str, dict[str, Place]]  # by section: the names, and where they are written


def read_names(node: YamlNode | None, keys: tuple[str, ...], faults: Faults) -> Without:
    """Return the names, by section; ``keys`` are the sections that may be named."""
    fields = faults.collect(node.fields, (), keys, faults) if node is not None else None
    found: Without = {}
    for key, names in fields.pairs() if fields is not None else ():
        items = faults.collect(names.items) or []
        texts = [(faults.collect(item.text), item.place) for item in items]
        found[key.value] = {text: place for text, place in texts if text is not None}
    return found


def names_schema(keys: tuple[str, ...]) -> Schema:
    """Return the schema: lists of names by section."""
    return closed(keys, {key: list_of(TEXT, "names that are taken away") for key in keys})


def kept(entries: Mapping[str, Any], names: Collection[str]) -> dict[str, Any]:
    """Return the entries that are not taken away."""
    return {name: entry for name, entry in entries.items() if name not in names}
