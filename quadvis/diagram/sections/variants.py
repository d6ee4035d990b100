"""`variants`: other blocks for the slots of a diagram, by name of the variant."""

from __future__ import annotations

from dataclasses import dataclass, field

from quadvis.diagram.entries import named_entries
from quadvis.diagram.sections.blocks import Blocks, read_block
from quadvis.diagram.sections.forms import TEXT, Schema, closed, map_of, ref
from quadvis.diagram.sections.section import FileSection
from quadvis.document import YamlNode
from quadvis.errors import Faults, Place

VARIANT_KEYS = ("doc", "base", "slots")


@dataclass
class Variant:
    """The blocks that a variant puts into slots, and the variant on which it builds, with its place."""

    slots: Blocks = field(default_factory=dict)
    base: tuple[str, Place] | None = None


Variants = dict[str, Variant]


class VariantsSection(FileSection[Variants]):
    """The variants of a diagram."""

    key = "variants"
    words = (
        "`name: {slots: {block: {...}}}`: other blocks for those marked `slot: true`, which give the outputs "
        "that are read; `base: other` takes those of another variant first; `in`, `rate` and `at`, if left "
        "out, are those of the block replaced"
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
        })  # fmt: skip
        return map_of(variant, "other blocks for those marked 'slot: true'")


VARIANTS = VariantsSection()
