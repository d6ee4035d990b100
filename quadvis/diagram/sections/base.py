"""`base` and `without`: the diagram on which this one stands, and what it takes away from there."""

from __future__ import annotations

from typing import Any, NamedTuple

from quadvis.diagram.sections.blocks import BLOCKS
from quadvis.diagram.sections.computers import COMPUTERS
from quadvis.diagram.sections.forms import TEXT, Schema, closed
from quadvis.diagram.sections.links import LINKS
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.rates import RATES
from quadvis.diagram.sections.section import FileSection, Section
from quadvis.diagram.sections.summary import SUMMARY
from quadvis.diagram.sections.variants import VARIANTS
from quadvis.diagram.sections.without import Without, names_schema, read_names
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown

BASE_KEYS = ("file", "variant")
MERGED: tuple[Section[Any], ...] = (PARAMS, RATES, COMPUTERS, LINKS, BLOCKS, VARIANTS, SUMMARY)
"""The sections whose entries have names. They are merged with those of the base, name by name."""
WITHOUT_KEYS = tuple(section.key for section in MERGED)


class BaseSpec(NamedTuple):
    """The file of a base as it is written, and the variant of it on which the diagram stands."""

    file: str
    place: Place
    variant: str | None = None
    variant_place: Place | None = None


class BaseSection(FileSection[BaseSpec | Unknown | None]):
    """The diagram on which this one stands."""

    key = "base"
    words = (
        "the diagram on which this one stands: `file.yaml`, or `{file: file.yaml, variant: name}`, see below"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> BaseSpec | Unknown | None:
        """Return the file and the variant; None if there is no base."""
        if node is None:
            return None
        if not isinstance(node, YamlMap):
            return faults.read(lambda: BaseSpec(node.text(), node.place))
        fields = node.fields(BASE_KEYS[:1], BASE_KEYS[1:], faults)
        texts = {key: faults.collect(value.text) for key, value in fields.values.items()}
        file, variant = texts.get("file"), texts.get("variant")
        if file is None or ("variant" in fields and variant is None):
            return UNKNOWN
        chosen = fields["variant"].place if variant is not None else None
        return BaseSpec(file, fields["file"].place, variant, chosen)

    def schema(self) -> Schema:
        """Return the schema: a file, or a file and a variant."""
        chosen = closed(BASE_KEYS, {"file": TEXT, "variant": TEXT}, BASE_KEYS[:1])
        return {"anyOf": [TEXT, chosen], "description": "the diagram on which this one stands"}


class WithoutSection(FileSection[Without]):
    """The entries of the base that are taken away."""

    key = "without"
    words = (
        "names that are taken away from the base: `{blocks: [names], variants: [names], summary: [labels]}`; "
        "so with `params`, `rates`, `computers`, `links`"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> Without:
        """Return the names, by section."""
        return read_names(node, WITHOUT_KEYS, faults)

    def schema(self) -> Schema:
        """Return the schema: lists of names by section."""
        return names_schema(WITHOUT_KEYS)


BASE, WITHOUT = BaseSection(), WithoutSection()
