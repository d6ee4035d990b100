"""What differs between two resolved diagrams, as plain data: section by section, block by block."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from quadvis.diagram.sections.log import LOG
from quadvis.diff.texts import changed_texts, entry_text, is_quantity, value_text, wire_text

ADDED, REMOVED, CHANGED = "added", "removed", "changed"
BLOCKS = "blocks"
SKIPPED = ("quadvis",)  # the version of the format


@dataclass(frozen=True)
class EntryChange:
    """One thing that differs, and how both sides have it, as texts; "" if a side does not have it."""

    name: str
    old: str = ""
    new: str = ""

    @property
    def kind(self) -> str:
        """``added``, ``removed`` or ``changed``."""
        return CHANGED if self.old and self.new else ADDED if self.new else REMOVED

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {"name": self.name, "kind": self.kind, "old": self.old or None, "new": self.new or None}


@dataclass(frozen=True)
class BlockChange:
    """A block that differs; ``old`` and ``new`` are its classes, "" on a side that does not have it."""

    path: str
    old: str
    new: str
    changes: tuple[EntryChange, ...] = ()

    @property
    def kind(self) -> str:
        """``added``, ``removed`` or ``changed``."""
        return EntryChange(self.path, self.old, self.new).kind

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        changes = [change.facts() for change in self.changes]
        return {"block": self.path, "kind": self.kind, "old": self.old or None, "new": self.new or None,
                "changes": changes}  # fmt: skip


@dataclass(frozen=True)
class DiagramChanges:
    """What differs between two diagrams; ``same`` is the number of blocks that are equal."""

    sections: Mapping[str, tuple[EntryChange, ...]] = field(default_factory=dict)
    blocks: tuple[BlockChange, ...] = ()
    same: int = 0

    def __bool__(self) -> bool:
        return bool(self.sections or self.blocks)


def compare_diagrams(old: Mapping[str, Any], new: Mapping[str, Any]) -> DiagramChanges:
    """Return what differs between two resolved diagrams.

    That a block which only one side has is logged only there goes without saying.
    """
    before, after = old.get(BLOCKS, {}), new.get(BLOCKS, {})
    single = before.keys() ^ after.keys()
    sections = {}
    for key in dict.fromkeys([*old, *new]):
        if key in (*SKIPPED, BLOCKS):
            continue
        found = list(_value_changes(key, *_alike(old.get(key), new.get(key))))
        if key == LOG.key:
            found = [change for change in found if (change.old or change.new) not in single]
        if found:
            sections[key] = tuple(found)
    paths = dict.fromkeys([*before, *after])
    blocks = [block for path in paths if (block := _block(path, before.get(path), after.get(path)))]
    both = before.keys() & after.keys()
    return DiagramChanges(sections, tuple(blocks), len(both) - sum(block.path in both for block in blocks))


def _block(path: str, old: Mapping[str, Any] | None, new: Mapping[str, Any] | None) -> BlockChange | None:
    """Return how a block differs; None if it does not."""
    if old is None or new is None:
        kinds, rates = (
            ["" if each is None else str(each.get(key, "")) for each in (old, new)]
            for key in ("block", "rate")
        )
        return BlockChange(path, kinds[0], kinds[1], (EntryChange("rate", *rates),))
    before, after = (
        {key: each[key] for key in each if key not in ("block", "with", "in")} for each in (old, new)
    )
    found = [*_map_changes("", before, after), *_map_changes("", old.get("with", {}), new.get("with", {}))]
    wires = ({port: wire_text(source) for port, source in each.get("in", {}).items()} for each in (old, new))
    found += _map_changes("in", *wires)
    if not found and old["block"] == new["block"]:
        return None
    return BlockChange(path, old["block"], new["block"], tuple(found))


def _map_changes(name: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[EntryChange]:
    """Yield what differs between two maps, entry by entry."""
    for key in dict.fromkeys([*old, *new]):
        inner = f"{name}.{key}" if name else str(key)
        yield from _value_changes(inner, old.get(key), new.get(key))


def _value_changes(name: str, old: Any, new: Any) -> Iterator[EntryChange]:
    """Yield what differs between two values; None is none. Maps and lists of entries differ in parts."""
    if old == new and type(old) is type(new):
        return
    old, new = _titled(old), _titled(new)
    if old is None or new is None:
        yield EntryChange(name, *("" if each is None else value_text(each) for each in (old, new)))
    elif all(isinstance(each, dict) and not is_quantity(each) for each in (old, new)):
        yield from _map_changes(name, old, new)
    elif all(isinstance(each, list) and _are_entries(each) for each in (old, new)):
        before, after = list(map(entry_text, old)), list(map(entry_text, new))
        yield from (EntryChange(name, old=text) for text in before if text not in after)
        yield from (EntryChange(name, new=text) for text in after if text not in before)
    else:
        yield EntryChange(name, *changed_texts(old, new))


def _alike(old: Any, new: Any) -> tuple[Any, Any]:
    """Return two sections; one that is missing is an empty map or list if the other is a map or a list."""
    if isinstance(old, dict | list) and new is None:
        return old, type(old)()
    if isinstance(new, dict | list) and old is None:
        return type(new)(), new
    return old, new


def _are_entries(values: list[Any]) -> bool:
    """Whether the values of a list are entries, such as expectations or signals, and no numbers."""
    return all(isinstance(each, dict | str) for each in values)


def _titled(value: Any) -> Any:
    """Return a list of entries that all have a title as a map by this title; others as they are."""
    if not isinstance(value, list) or not all(isinstance(each, dict) and "title" in each for each in value):
        return value
    return {each["title"]: {key: each[key] for key in each if key != "title"} for each in value}
