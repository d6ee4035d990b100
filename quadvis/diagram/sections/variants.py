"""`variants`: other blocks for the slots of a diagram and what follows from them, by name of the variant."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

from quadvis.diagram.entries import named_entries
from quadvis.diagram.sections.blocks import Blocks, read_block
from quadvis.diagram.sections.forms import TEXT, Schema, closed, map_of, ref
from quadvis.diagram.sections.params import PARAMS, Params
from quadvis.diagram.sections.section import FileSection
from quadvis.diagram.sections.without import Without, kept, names_schema, read_names
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import Faults, Place

REPLACED = (
    "log",
    "analyse",
    "expect",
    "summary",
    "figures",
)  # sections that a variant may have in place of the diagram's
WITHOUT_KEYS = ("blocks", "computers", "links")
VARIANT_KEYS = ("doc", "base", "slots", "params", "without", *REPLACED)


@dataclass
class Variant:
    """The blocks that a variant puts into slots, and the variant on which it builds, with its place.

    ``params`` have other values, what ``without`` names is taken away, and ``nodes`` are the sections that
    stand in the place of the diagram's.
    """

    slots: Blocks = field(default_factory=dict)
    base: tuple[str, Place] | None = None
    params: Params = field(default_factory=dict)
    without: Without = field(default_factory=dict)
    nodes: dict[str, YamlNode] = field(default_factory=dict)

    def on(self, removed: Collection[str]) -> Variant:
        """Return the variant of a diagram from which these blocks are taken away."""
        without = {**self.without, "blocks": kept(self.without.get("blocks", {}), removed)}
        return replace(self, slots=kept(self.slots, removed), without=without)


Variants = dict[str, Variant]


class VariantsSection(FileSection[Variants]):
    """The variants of a diagram."""

    key = "variants"
    words = (
        "`name: {slots: {block: {...}}}`: other blocks for those marked `slot: true`, which give the outputs "
        "that are read; `base: other` takes those of another variant first; `in`, `rate` and `at`, if left "
        "out, are those of the block replaced; `params` have other values, `without: {blocks: [names]}` "
        "(and `computers`, `links`) takes away, `log`, `analyse`, `expect`, `summary` and `figures` stand in "
        "the place of the diagram's"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> Variants:
        """Return the variants in the order of the file."""
        found: Variants = {}
        for name, value in named_entries(node, "variant", faults):
            found[name] = variant = Variant()
            with faults.about(f"variant '{name}'"):
                fields = faults.collect(value.fields, (), VARIANT_KEYS, faults)
                slots = fields.get("slots") if fields is not None else None
                mapping = faults.collect(slots.mapping) if slots is not None else None
                base = (
                    faults.collect(fields["base"].text) if fields is not None and "base" in fields else None
                )
                if fields is not None and base is not None:
                    variant.base = base, fields["base"].place
                if fields is not None:
                    _read_changes(variant, fields, faults)
            for key, entry in mapping.pairs() if mapping is not None else []:
                with faults.about(f"variant '{name}', block '{key.value}'"):
                    variant.slots[key.value] = read_block(key.value, key.place, entry, faults)
        return found

    def schema(self) -> Schema:
        """Return the schema: blocks by slot, by name of the variant."""
        variant = closed(VARIANT_KEYS, {
            "doc": TEXT,
            "base": {"type": "string", "description": "the variant on which this one builds"},
            "slots": map_of(ref("block"), "by slot"),
            "params": PARAMS.schema(),
            "without": names_schema(WITHOUT_KEYS),
            **{key: {"description": "in place of that of the diagram"} for key in REPLACED},
        })  # fmt: skip
        return map_of(variant, "other blocks for those marked 'slot: true'")


def _read_changes(variant: Variant, fields: YamlMap, faults: Faults) -> None:
    """Read what a variant changes beside its slots."""
    entries = dict(fields.values)
    variant.params = PARAMS.read(entries.get("params"), faults)
    variant.without = read_names(entries.get("without"), WITHOUT_KEYS, faults)
    variant.nodes = {key: entries[key] for key in REPLACED if key in entries}


VARIANTS = VariantsSection()
