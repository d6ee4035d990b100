"""What `quadvis diff` prints: the difference in words and colours, blocks by their part."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from quadvis.diagram.keys import RUN_SECTIONS
from quadvis.diff.changes import ADDED, CHANGED, REMOVED, BlockChange, EntryChange
from quadvis.diff.difference import Comparison
from quadvis.diff.signals import SignalChanges
from quadvis.errors import counted
from quadvis.machine.columns import table

SIGNS = {ADDED: "+", REMOVED: "-", CHANGED: "~"}
RED, GREEN, YELLOW, BOLD, PLAIN = "\x1b[31m", "\x1b[32m", "\x1b[33m", "\x1b[1m", "\x1b[0m"
COLOURS = {ADDED: GREEN, REMOVED: RED, CHANGED: YELLOW}
SHOWN = 40  # signals


class DiffReport:
    """The lines of a difference, with colours for a terminal or without."""

    def __init__(self, found: Comparison, colour: bool = False) -> None:
        self._found, self._colour = found, colour

    def lines(self) -> Iterator[str]:
        """Yield the lines."""
        found = self._found
        yield self._painted(f"{found.old.name} -> {found.new.name}", BOLD)
        if found.same:
            yield "the same"
            return
        for damage in (side.log.damage for side in (found.old, found.new) if side.log and side.log.damage):
            yield f"  {damage}"
        yield from self._section("run", found.facts)
        sections, behind = found.diagram.sections, [section.key for section in RUN_SECTIONS]
        for key in sections:
            yield from self._section(key, sections[key]) if key not in behind else ()
        if found.diagram.blocks:
            yield self._painted(f"blocks: {self._counts()}", BOLD)
            yield from self._blocks(found.diagram.blocks)
        for key in behind:
            yield from self._section(key, sections.get(key, ()))
        if not found.diagram:
            yield "the diagrams are the same"
        if found.signals is not None:
            yield from self._signals(found.signals)

    def _section(self, title: str, changes: Iterable[EntryChange]) -> Iterator[str]:
        changes = list(changes)
        if not changes:
            return
        prefix = f"{title}."
        yield self._painted(title, BOLD)
        yield from self._changes([
            EntryChange("" if each.name == title else each.name.removeprefix(prefix), each.old, each.new)
            for each in changes
        ], "  ")  # fmt: skip

    def _changes(self, changes: list[EntryChange], indent: str) -> Iterator[str]:
        """Yield a line for each change, their names in one column."""
        width = max(len(change.name) for change in changes)
        for change in changes:
            sign = self._painted(SIGNS[change.kind], COLOURS[change.kind])
            name = f"{change.name.ljust(width)}  " if width else ""
            yield f"{indent}{sign} {name}{self._values(change.old, change.new)}".rstrip()

    def _values(self, old: str, new: str) -> str:
        """Return the two values of a change, or the only one."""
        if old and new:
            return f"{self._painted(old, RED)} -> {self._painted(new, GREEN)}"
        return self._painted(old, RED) if old else self._painted(new, GREEN)

    def _counts(self) -> str:
        """Return how many blocks were added, removed, changed, and are the same."""
        blocks = self._found.diagram.blocks
        counts = [(sum(each.kind == kind for each in blocks), kind) for kind in (ADDED, REMOVED, CHANGED)]
        said = [f"{count} {kind}" for count, kind in counts if count]
        return ", ".join([*said, f"{self._found.diagram.same} the same"])

    def _blocks(self, blocks: Iterable[BlockChange]) -> Iterator[str]:
        """Yield the blocks, those of a part together under its name, in the order of the diagrams."""
        parts: dict[str, list[BlockChange]] = {}
        for block in blocks:
            parts.setdefault(block.path.rpartition("/")[0], []).append(block)
        for part, inner in parts.items():
            indent = "  "
            if part:
                yield f"  {self._painted(f'{part}/', BOLD)}"
                indent = "    "
            for alike, group in groupby(inner, key=lambda each: each.kind != CHANGED):
                members = list(group)
                if alike:
                    yield from self._short(members, indent)
                else:
                    for member in members:
                        yield from self._long(member, indent)

    def _short(self, blocks: list[BlockChange], indent: str) -> Iterator[str]:
        """Yield a line for each block that only one side has."""
        rows = [
            (_name(block), block.old or block.new, *(_shown(each) for each in block.changes))
            for block in blocks
        ]
        for block, line in zip(blocks, table(rows), strict=True):
            yield indent + self._painted(f"{SIGNS[block.kind]} {line}", COLOURS[block.kind])

    def _long(self, block: BlockChange, indent: str) -> Iterator[str]:
        """Yield a block that both sides have, and what is different in it."""
        sign = self._painted(SIGNS[CHANGED], YELLOW)
        kind = block.old if block.old == block.new else self._values(block.old, block.new)
        yield f"{indent}{sign} {_name(block)}  {kind}"
        if block.changes:
            yield from self._changes(list(block.changes), f"{indent}    ")

    def _signals(self, signals: SignalChanges) -> Iterator[str]:
        """Yield which signals differ, from when on and by how much."""
        if not signals:
            yield f"signals: all {signals.compared} are the same to the bit"
            return
        what = f"{len(signals.different)} of {signals.compared} differ"
        yield self._painted(f"signals: {what}", BOLD)
        rows = []
        for each in signals.different[:SHOWN]:
            difference = each.difference
            rows.append((
                difference.signal,
                f"from t = {each.time:.9g} s on",
                f"by {difference.largest:.3g} {difference.unit}".rstrip(),
                f"in {difference.count} of {counted(difference.rows, 'row')}",
            ))  # fmt: skip
        yield from (f"  {self._painted('~', YELLOW)} {line}" for line in table(rows))
        if len(signals.different) > SHOWN:
            yield f"  and {len(signals.different) - SHOWN} more; --json lists all"
        for name, what in signals.unlike:
            yield f"  {self._painted('~', YELLOW)} {name}: {what}"
        for names, sign, colour in ((signals.only_old, "-", RED), (signals.only_new, "+", GREEN)):
            shown = [name for name in names if name.rpartition(".")[0] not in self._single]
            yield from (self._painted(f"  {sign} {name}", colour) for name in shown)
            if len(shown) < len(names):
                what = f"{counted(len(names) - len(shown), 'signal')} of the blocks above"
                yield self._painted(f"  {sign} {what}", colour)

    @property
    def _single(self) -> set[str]:
        """The blocks that only one side has."""
        return {block.path for block in self._found.diagram.blocks if block.kind != CHANGED}

    def _painted(self, text: str, colour: str) -> str:
        return f"{colour}{text}{PLAIN}" if self._colour and text else text


def _name(block: BlockChange) -> str:
    return block.path.rpartition("/")[2]


def _shown(change: EntryChange) -> str:
    return change.old or change.new
