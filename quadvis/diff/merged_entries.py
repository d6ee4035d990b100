"""The entries of a map or list of one version of a file: their values, and their lines with comments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from quadvis.diff.flat import plain
from quadvis.document.source import LIST, MAP, SCALAR, SourceText, SourceValue

Data = tuple[object, ...]


class MergedEntry(NamedTuple):
    """An entry of a map or list on one side: its value, and its lines with what stands before them."""

    source: SourceText
    value: SourceValue
    lines: tuple[str, ...]
    data: Data
    column: int


def data_of(value: SourceValue) -> Data:
    """Return what a value means, for comparison."""
    if value.kind == SCALAR:
        return (value.value, bool(value.style))
    if value.kind == LIST:
        return (LIST, *map(data_of, value.children))
    return (MAP, *sorted((key.value, data_of(each)) for key, each in value.pairs))


def entries(whole: MergedEntry) -> list[tuple[str, MergedEntry]]:
    """Return the entries of a map or list by key, each with its lines; those of a list have no key."""
    source, value = whole.source, whole.value
    pairs = value.pairs if value.kind == MAP else [(each, each) for each in value.children]
    found = []
    if not value.is_block:
        for key, each in pairs:
            head = f"{source.written(key)}:" if value.kind == MAP else "-"
            lines: tuple[str, ...] = (f"{' ' * whole.column}{head} {plain(source, each)}",)
            found.append((key.value, MergedEntry(source, each, lines, data_of(each), whole.column)))
        return found
    first = value.line if whole.lines or value.line == 0 else 0
    after = _after_key(whole, first)
    for key, each in pairs:
        last = max(each.last, key.line)
        lines = tuple(source.lines[after : last + 1])
        if value.kind == MAP and lines and after == key.line:
            lines = (" " * key.column + lines[0][key.column :], *lines[1:])  # without a dash before it
        name = key.value if value.kind == MAP else ""
        found.append((name, MergedEntry(source, each, lines, data_of(each), value.column)))
        after = last + 1
    return found


def _after_key(whole: MergedEntry, first: int) -> int:
    """Return the first line that belongs to the entries of a map or list, comments before them included."""
    source, line = whole.source, first
    while line > 0 and whole.lines:
        above = source.comments.get(line - 1)
        if not source.is_blank(line - 1) and (above is None or not above.alone):
            break
        line -= 1
    return line


def moved(entry: MergedEntry, column: int) -> list[str]:
    """Return the lines of an entry, indented as those are that begin in a column."""
    shift = column - entry.column
    if shift >= 0:
        return [" " * shift + line if line.strip() else line for line in entry.lines]
    return [line[-shift:] if not line[:-shift].strip() else line for line in entry.lines]


def nothing(like: SourceValue) -> SourceValue:
    """Return a map or list like another one, without entries."""
    return SourceValue(like.kind, like.start, like.line, like.column, flow=True)


def placed(entry: MergedEntry, like: MergedEntry) -> MergedEntry:
    """Return an entry whose inner lines stand in the column of those of `like`."""
    column = entry.value.column if entry.value.is_block else like.column
    return MergedEntry(entry.source, entry.value, entry.lines, entry.data, column)


def head_of(entry: MergedEntry) -> tuple[str, ...]:
    """Return the lines of a map or list in blocks before those of its entries: comments, and its key."""
    begin = _after_key(entry, entry.value.line)
    return entry.lines[: len(entry.lines) - (entry.value.last - begin + 1)]


def under(head: Sequence[str], inner: list[str], ours: MergedEntry) -> list[str]:
    """Return the line of a key or a dash with the lines under it."""
    first = ours.source.lines[ours.value.line]
    dash = first[: ours.value.column].rstrip()
    if dash.endswith("-") and not head:
        place = next(
            number for number, line in enumerate(inner) if line.strip() and line.lstrip()[0] not in "#<"
        )
        inner[place] = first[: ours.value.column] + inner[place][ours.value.column :]
    return [*head, *inner]


def replaced(ours: MergedEntry, text: str) -> list[str]:
    """Return the lines of an entry with another value in brackets."""
    value = ours.value
    line = ours.source.lines[value.line]
    end = value.end - value.start + value.column
    changed = f"{line[: value.column]}{text}{line[end:]}"
    return [changed if each.endswith(line.lstrip()) else each for each in ours.lines]
