"""What the variants of a diagram that flies share: desk, bench and flight must differ in slots alone."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from quadvis.diff.changes import BLOCKS, EntryChange, compare_diagrams
from quadvis.errors import counted

WIRE = "in."
LOOKED_AT = ("rates", "solver", "tasking", "computers", "links", "overload")


class SharedBlocks(NamedTuple):
    """The variants that were compared, what differs between any two of them, and how many blocks do not.

    ``differing`` are blocks and parts of the diagram, ``sections`` keys beside the blocks. A block that
    reads another block in the place of one that differs is the same.
    """

    variants: tuple[str, ...]
    differing: tuple[str, ...]
    sections: tuple[str, ...]
    same: int

    def __str__(self) -> str:
        what, same = (
            (*self.differing, *self.sections),
            f"{counted(self.same, 'block')} are the same to the bit",
        )
        verb = f"differ in {', '.join(what)}" if what else "do not differ"
        return f"{', '.join(self.variants)} {verb}; {same}"


def shared_blocks(resolved: Mapping[str, Mapping[str, Any]]) -> SharedBlocks:
    """Compare resolved diagrams (as plain data), by the names of their variants."""
    names = tuple(resolved)
    first = resolved[names[0]]
    found = [compare_diagrams(first, resolved[name]) for name in names[1:]]
    blocks = [block for changes in found for block in changes.blocks]
    owners = {_owner(block.path) for block in blocks if not all(map(_is_wire, block.changes))}
    for block in blocks:
        for change in block.changes:
            if _is_wire(change) and not {_owner(change.old), _owner(change.new)} <= owners:
                owners.add(_owner(block.path))
    same = sum(_owner(path) not in owners for path in first[BLOCKS])
    sections = {key for changes in found for key in changes.sections if key in LOOKED_AT}
    return SharedBlocks(names, tuple(sorted(owners)), tuple(sorted(sections)), same)


def _owner(name: str) -> str:
    """Return the block or part of the diagram to which a path, or the source of a wire, belongs."""
    return re.split(r"[/.\[ ]", name, maxsplit=1)[0]


def _is_wire(change: EntryChange) -> bool:
    return change.name.startswith(WIRE)
