"""Three versions of a YAML file merged by their keys: git's work line by line, done by what lines mean.

Two people who change different keys of one block, or add different blocks at one place, have no conflict.
Each entry keeps its lines with their comments, from the side that changed it; the rest is as in `ours`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from quadvis.diff.align import aligned
from quadvis.diff.flat import plain
from quadvis.diff.merged_entries import (
    MergedEntry,
    data_of,
    entries,
    head_of,
    moved,
    nothing,
    placed,
    replaced,
    under,
)
from quadvis.document.source import LIST, MAP, SCALAR, SourceText
from quadvis.errors import DiagramError, quoted

OURS, THEIRS = "ours", "theirs"
MARKS = f"<<<<<<< {OURS}", "=======", f">>>>>>> {THEIRS}"


class Merged(NamedTuple):
    """The merged text, and a sentence for each conflict in it, whose both versions stand between marks."""

    text: str
    conflicts: tuple[str, ...]


def merge(base: str, ours: str, theirs: str) -> Merged:
    """Merge two texts that come from a third one; DiagramError if one of them is no YAML."""
    sources = [SourceText(text, name) for text, name in ((base, "base"), (ours, OURS), (theirs, THEIRS))]
    roots = [MergedEntry(each, each.root, (), data_of(each.root), 0) for each in sources]
    merging = _Merging()
    kinds = {each.value.kind for each in roots}
    if len(kinds) > 1 or SCALAR in kinds:
        for entry, text in ((roots[2], ours), (roots[1], theirs)):
            if entry.data == roots[0].data:
                return Merged(text, ())
        merging.conflicts.append("the files are not all maps, or all lists")
        lines = [MARKS[0], *ours.splitlines(), MARKS[1], *theirs.splitlines(), MARKS[2]]
    else:
        lines = merging.inside(roots, "")
        end = [each.lines[each.root.last + 1 :] for each in sources]
        lines += end[2] if end[1] == end[0] else end[1]
    text = "\n".join(lines).rstrip("\n") + "\n"
    if not merging.conflicts:
        SourceText(text, "merged")
    return Merged(text, tuple(merging.conflicts))


class _Merging:
    """One merge; `conflicts` grows."""

    def __init__(self) -> None:
        self.conflicts: list[str] = []

    def inside(self, sides: Sequence[MergedEntry], path: str) -> list[str]:
        """Return the lines of the entries of three maps or lists; those of `ours` are in blocks."""
        base, ours, theirs = (entries(each) for each in sides)
        column = sides[1].value.column if sides[1].value.is_block else sides[1].column
        if sides[1].value.kind == LIST:
            return [line for each in self._list(base, ours, theirs, path, column) for line in each]
        found = dict(base), dict(ours), dict(theirs)
        lines: list[str] = []
        for key in _order(list(found[1]), list(found[2])):
            lines += self._entry([each.get(key) for each in found], f"{path}.{key}" if path else key, column)
        return lines

    def _entry(self, sides: Sequence[MergedEntry | None], path: str, column: int) -> list[str]:
        """Return the lines of one entry, none if it is gone."""
        base, ours, theirs = sides
        if ours is None or theirs is None:
            there = ours or theirs
            assert there is not None
            if base is None:
                return moved(there, column)
            if there.data == base.data:
                return []
            return self._conflict(base, ours, theirs, path, column)
        if base is not None and ours.lines == base.lines:
            return moved(theirs, column)
        if base is not None and theirs.lines == base.lines:
            return list(ours.lines)
        alike = base is not None and base.value.kind == ours.value.kind == theirs.value.kind
        if alike and all(each.value.is_block for each in (base, ours, theirs) if each):
            return self._both(base, ours, theirs, path, column)  # for the comments inside
        if ours.data == theirs.data or (base is not None and theirs.data == base.data):
            return list(ours.lines)
        if base is not None and ours.data == base.data:
            return moved(theirs, column)
        return self._both(base, ours, theirs, path, column)

    def _both(
        self, base: MergedEntry | None, ours: MergedEntry, theirs: MergedEntry, path: str, column: int
    ) -> list[str]:
        """Return the lines of an entry that both sides have changed."""
        known = len(self.conflicts)
        kinds = {each.value.kind for each in (base, ours, theirs) if each is not None}
        if len(kinds) == 1 and SCALAR not in kinds:
            start = base or MergedEntry(ours.source, nothing(ours.value), ours.lines, (), ours.column)
            if ours.value.is_block:
                head = head_of(ours)
                if (
                    base is not None
                    and base.value.is_block
                    and theirs.value.is_block
                    and head == head_of(base)
                ):
                    head = tuple(moved(theirs, ours.column)[: len(head_of(theirs))])
                inner = MergedEntry(ours.source, ours.value, ours.lines, ours.data, ours.value.column)
                made = self.inside([placed(start, inner), inner, placed(theirs, inner)], path)
                if any(line.strip() for line in made):
                    return under(head, made, ours)
                return self._conflict(base, ours, theirs, path, column)  # nothing is left of it
            text = self._flow(start, ours, theirs, path)
            if text is not None and ours.value.line == ours.value.last:
                return replaced(ours, text)
        if len(self.conflicts) == known:
            return self._conflict(base, ours, theirs, path, column)
        return _marked(ours, theirs, column)

    def _flow(self, base: MergedEntry, ours: MergedEntry, theirs: MergedEntry, path: str) -> str | None:
        """Return a map in brackets that both have changed, None with a conflict, and for a list."""
        if ours.value.kind != MAP:
            return None
        sides = [dict(entries(each)) for each in (base, ours, theirs)]
        texts: list[str] = []
        known = len(self.conflicts)
        keys = {key.value: each.source.written(key) for each in (theirs, ours) for key, _ in each.value.pairs}
        for key in _order(list(sides[1]), list(sides[2])):
            for line in self._entry([each.get(key) for each in sides], f"{path}.{key}", 0):
                texts.append(f"{keys[key]}:{line.lstrip()[len(keys[key]) + 1 :]}")
        return None if len(self.conflicts) > known else f"{{{', '.join(texts)}}}"

    def _list(
        self,
        base: list[tuple[str, MergedEntry]],
        ours: list[tuple[str, MergedEntry]],
        theirs: list[tuple[str, MergedEntry]],
        path: str,
        column: int,
    ) -> Iterator[list[str]]:
        """Yield the lines of the elements of three lists, stretch by stretch."""
        sides = [[entry for _, entry in each] for each in (base, ours, theirs)]
        for places in aligned([[entry.data for entry in side] for side in sides]):
            old, mine, other = (side[place] for side, place in zip(sides, places, strict=True))
            datas = [[entry.data for entry in each] for each in (old, mine, other)]
            if datas[2] == datas[0] or datas[1] == datas[2]:
                yield [line for each in mine for line in each.lines]
            elif datas[1] == datas[0]:
                yield [line for each in other for line in moved(each, column)]
            elif len(old) == len(mine) == len(other):
                for number, each in enumerate(zip(old, mine, other, strict=True), places[0].start):
                    yield self._entry(each, f"{path}[{number}]", column)
            elif not old and all(each.value.kind == MAP for each in (*mine, *other)):
                new = [each for each in other if each.data not in datas[1]]
                yield [line for each in (*mine, *new) for line in moved(each, column)]
            else:
                yield self._stretch(mine, other, f"{path}[{places[0].start}]", column)

    def _stretch(
        self, ours: list[MergedEntry], theirs: list[MergedEntry], path: str, column: int
    ) -> list[str]:
        self.conflicts.append(
            f"{path}: both sides change how many elements there are; keep those that are meant"
        )
        lines = [[line for each in side for line in moved(each, column)] for side in (ours, theirs)]
        return [MARKS[0], *lines[0], MARKS[1], *lines[1], MARKS[2]]

    def _conflict(
        self,
        base: MergedEntry | None,
        ours: MergedEntry | None,
        theirs: MergedEntry | None,
        path: str,
        column: int,
    ) -> list[str]:
        said = [f"{_short(each)} in {name}" for each, name in ((ours, OURS), (theirs, THEIRS))]
        before = f"; it was {_short(base)}" if base is not None else ""
        self.conflicts.append(f"{path} is {said[0]}, {said[1]}{before}")
        return _marked(ours, theirs, column)


def _marked(ours: MergedEntry | None, theirs: MergedEntry | None, column: int) -> list[str]:
    """Return the lines of both sides between the marks of git."""
    other = moved(theirs, column) if theirs is not None else []
    return [MARKS[0], *(ours.lines if ours else ()), MARKS[1], *other, MARKS[2]]


def _short(entry: MergedEntry | None) -> str:
    if entry is None:
        return "removed"
    text = plain(entry.source, entry.value)
    return quoted(text) if len(text) <= 60 else f"a {entry.value.kind}"


def _order(ours: list[str], theirs: list[str]) -> list[str]:
    """Return the keys of both: those of `ours`, and new ones of `theirs` behind what is before them there."""
    found = list(ours)
    for number, key in enumerate(theirs):
        if key not in found:
            before = [found.index(each) for each in theirs[:number] if each in found]
            found.insert(before[-1] + 1 if before else 0, key)
    return found


def merge_or_none(base: str, ours: str, theirs: str) -> Merged | None:
    """Merge as `merge`; None if a text is no YAML, or the result would be none."""
    try:
        return merge(base, ours, theirs)
    except DiagramError:
        return None
