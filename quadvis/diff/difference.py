"""The whole difference of two sides: what was run, of what it was made, and what came out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from quadvis.diff.changes import DiagramChanges, EntryChange, compare_diagrams
from quadvis.diff.sides import Side, read_side
from quadvis.diff.signals import SignalChanges, compare_signals
from quadvis.errors import QuadvisError
from quadvis.errors.caller import as_given
from quadvis.library.catalogue import OwnBlocks


@dataclass(frozen=True)
class Comparison:
    """What differs between two sides; ``signals`` is None unless both are logs."""

    old: Side
    new: Side
    facts: tuple[EntryChange, ...]
    diagram: DiagramChanges
    signals: SignalChanges | None = None

    @property
    def same(self) -> bool:
        """True if nothing differs."""
        return not (self.facts or self.diagram or self.signals)

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data."""
        signals = self.signals
        return {
            "old": self.old.name,
            "new": self.new.name,
            "same": self.same,
            "facts": [change.facts() for change in self.facts],
            "sections": {
                key: [change.facts() for change in changes] for key, changes in self.diagram.sections.items()
            },
            "blocks": [change.facts() for change in self.diagram.blocks],
            "same_blocks": self.diagram.same,
            "signals": None if signals is None else {
                "compared": signals.compared,
                "different": [{**each.difference.facts(), "time_s": each.time} for each in signals.different],
                "only_old": list(signals.only_old),
                "only_new": list(signals.only_new),
                "unlike": [{"signal": name, "what": what} for name, what in signals.unlike],
            },
        }  # fmt: skip


def diff(
    old: str | Path,
    new: str | Path | None = None,
    *,
    variants: tuple[str | None, str | None] = (None, None),
    own_blocks: OwnBlocks = True,
) -> Comparison:
    """Return the difference of two diagrams, two logs, or two variants of one diagram (``new`` is None).

    ``variants`` are those of the two sides; None is the diagram without a variant.
    """
    if new is None and variants[0] == variants[1]:
        option = as_given("--variants X Y", "variants")
        raise QuadvisError(
            f"'{old}' is compared with nothing; name a second file, or two variants by {option}"
        )
    sides = [
        read_side(path, variant, own_blocks)
        for path, variant in zip((old, old if new is None else new), variants, strict=True)
    ]
    before, after = sides
    facts = tuple(
        EntryChange(name, before.facts[name], after.facts[name])
        for name in before.facts
        if after.log and before.facts[name] != after.facts[name]
    )
    signals = compare_signals(before.log, after.log) if before.log and after.log else None
    return Comparison(before, after, facts, compare_diagrams(before.sections, after.sections), signals)
