"""A YAML file in the house style: the same values and comments, laid out in one way.

Levels are indented by two blanks, entries of lists too. Brackets stay brackets, with a blank behind each
comma and colon, and lists in lines stay so; a map in brackets that makes its line too long gets a line for
each key. One blank line at most divides entries. Comments stay where they are, and in their columns if there
is room.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from quadvis.document.source import LIST, MAP, SCALAR, SourceText, SourceValue
from quadvis.errors import DiagramError, QuadvisError

WIDTH = 120  # columns of a line without its comment
STEP = 2
GAP, FAR = 2, 12  # blanks before a comment; a line whose length changed by more leaves its comment's column
_INDICATOR = re.compile(r"^([|>][+-]?)[1-9]")
Path = tuple[str, ...]
ELEMENT = "#"  # in a path, for any element of a list
Ranks = Callable[[Path, Sequence[str]], Sequence[int]]


def as_written(path: Path, keys: Sequence[str]) -> Sequence[int]:
    """Leave the keys of every map in their order."""
    return [0] * len(keys)


def formatted(text: str, name: str = "<text>", ranks: Ranks = as_written) -> str:
    """Return a text in the house style; ``ranks`` says where the keys of the map at a path stand.

    DiagramError if the text is no YAML; QuadvisError if the result would mean anything else.
    """
    source = SourceText(text, name)
    found = _Layout(source, ranks).text()
    try:
        safe = same(source.root, SourceText(found, name).root, ranks, ())
    except DiagramError:
        safe = False
    if not safe:
        raise QuadvisError(f"'{name}' would not mean the same afterwards; it is left as it is. Report this")
    return found


def same(one: SourceValue, other: SourceValue, ranks: Ranks, path: Path) -> bool:
    """Return whether two values mean the same, with the same order of all keys whose order may matter."""
    if one.kind != other.kind:
        return False
    if one.kind == SCALAR:
        return one.value == other.value and bool(one.style) == bool(other.style)
    if len(one.children) != len(other.children):
        return False
    if one.kind == LIST:
        inner = (*path, ELEMENT)
        return all(same(*each, ranks, inner) for each in zip(one.children, other.children, strict=True))
    pairs = _ordered(one, ranks, path), _ordered(other, ranks, path)
    return all(
        key.value == twin.value and same(value, second, ranks, (*path, key.value))
        for (key, value), (twin, second) in zip(*pairs, strict=True)
    )


def _ordered(value: SourceValue, ranks: Ranks, path: Path) -> list[tuple[SourceValue, SourceValue]]:
    pairs = value.pairs
    places = ranks(path, [key.value for key, _ in pairs])
    return [pairs[number] for number in sorted(range(len(pairs)), key=lambda number: places[number])]


class _Layout:
    """Lays out one text. Lines are taken from top to bottom: `next` is the first that was not."""

    def __init__(self, source: SourceText, ranks: Ranks) -> None:
        self.source, self.ranks, self.next = source, ranks, 0
        self.pending = dict(source.comments)

    def text(self) -> str:
        root = self.source.root
        if root.is_block:
            lines = self._map(root, 0, ()) if root.kind == MAP else self._list(root, 0, ())
        else:
            lines = [*self._head(root.line, 0), *self._entry("", root, 0, (), root.line)]
        while lines and not lines[0]:
            lines.pop(0)
        end = self._head(len(self.source.lines), 0)
        while end and not end[-1]:
            end.pop()
        return "\n".join([*lines, *end]) + "\n"

    def _head(self, line: int, indent: int) -> list[str]:
        """Return the comments and blank lines before a line."""
        found: list[str] = []
        for number in range(self.next, line):
            comment = self.pending.pop(number, None)
            if comment is not None:  # one behind a dash stands above it afterwards
                found.append(" " * indent + comment.text)
            elif self.source.is_blank(number) and (not found or found[-1]):
                found.append("")
        self.next = max(self.next, line)
        return found

    def _tail(self, column: int, indent: int) -> list[str]:
        """Return the comments behind the last entry that are indented like it."""
        last = None
        for number in range(self.next, len(self.source.lines)):
            comment = self.pending.get(number)
            if comment is not None and comment.alone and comment.column >= max(column, 1):
                last = number
            elif not self.source.is_blank(number):
                break
        return [] if last is None else self._head(last + 1, indent)

    def _map(self, value: SourceValue, indent: int, path: Path) -> list[str]:
        """Return the lines of a map in blocks, its keys in their order."""
        chunks: list[list[str]] = []
        first: list[str] = []
        for key, each in value.pairs:
            head = self._head(key.line, indent)
            if not chunks:
                first, head = self._opening(head, path)
            name = self.source.written(key)
            chunks.append([*head, *self._entry(f"{name}:", each, indent, (*path, key.value), key.line)])
        end = self._tail(value.column, indent)
        places = self.ranks(path, [key.value for key, _ in value.pairs])
        order = sorted(range(len(chunks)), key=lambda number: places[number])
        if order[0] != 0:
            while chunks[order[0]] and not chunks[order[0]][0]:
                chunks[order[0]].pop(0)
        return [*first, *(line for number in order for line in chunks[number]), *end]

    @staticmethod
    def _opening(head: list[str], path: Path) -> tuple[list[str], list[str]]:
        """Divide what stands before the first entry: the head of the file stays there."""
        if not path:
            return head, []
        while head and not head[0]:
            head = head[1:]
        return [], head

    def _list(self, value: SourceValue, indent: int, path: Path) -> list[str]:
        """Return the lines of a list in blocks."""
        lines: list[str] = []
        for each in value.children:
            head = self._head(each.line, indent)
            while not lines and path and head and not head[0]:
                head.pop(0)
            lines += [*head, *self._element(each, indent, (*path, ELEMENT))]
        return lines + self._tail(value.column, indent)

    def _element(self, value: SourceValue, indent: int, path: Path) -> list[str]:
        """Return the lines of an element of a list; comments that begin it stand above its dash."""
        if not value.is_block:
            return self._entry("-", value, indent, path, value.line)
        inner = (self._map if value.kind == MAP else self._list)(value, indent + STEP, path)
        count = next(
            number for number, line in enumerate(inner) if line and not line.lstrip().startswith("#")
        )
        above = [line[STEP:] for line in inner[:count]]
        return [*above, f"{' ' * indent}- {inner[count][indent + STEP :]}", *inner[count + 1 :]]

    def _entry(self, head: str, value: SourceValue, indent: int, path: Path, line: int) -> list[str]:
        """Return the lines of a key or a dash with its value; its comment is behind the first one."""
        start = " " * indent + head
        if value.is_block:
            self.next = max(self.next, line + 1)
            mine = self._comment(start, line)
            between = self._head(value.line, indent) if value.kind == LIST and value.line > line else []
            inner = self._map(value, indent + STEP, path) if value.kind == MAP else None
            inner = self._list(value, indent + STEP, path) if inner is None else inner
            return [mine, *(f"{' ' * STEP}{each}" for each in between if each), *inner]
        if value.kind != SCALAR and _goes_on(value):
            for number in range(value.line, value.last):
                self.pending.pop(number, None)  # they go with the lines of the value
        inside = [self.pending.pop(number) for number in range(line, value.last) if number in self.pending]
        self.next = max(self.next, value.last + 1)
        lines = self._plain(start, value, indent, path)
        where = -1 if value.last > value.line and lines[-1].endswith(("]", "}", '"', "'")) else 0
        if value.style not in ("|", ">"):
            lines[where] = self._comment(lines[where], value.last)
        return [*(f"{' ' * indent}{each.text}" for each in inside), *lines]

    def _plain(self, start: str, value: SourceValue, indent: int, path: Path) -> list[str]:
        """Return the lines of a value that is no map or list in blocks."""
        joint = " " if start.strip() else ""
        if value.kind == SCALAR or _goes_on(value):
            lines = (self._text if value.style in ("|", ">") else self._as_it_is)(value, indent)
            return [f"{start}{joint}{lines[0]}".rstrip(" "), *lines[1:]]
        if value.last > value.line and value.kind == LIST:
            rows = self._rows(value, indent, path)
            if rows:
                return [f"{start}{joint}{rows[0]}", *rows[1:]]
        line = f"{start}{joint}{self._flow(value, path)}"
        return self._broken(start, value, indent, path) if len(line) > WIDTH else [line]

    def _text(self, value: SourceValue, indent: int) -> list[str]:
        """Return the lines of a text after ``|`` or ``>``, moved to their new level."""
        head, *lines = self.source.written(value).split("\n")
        if lines and not lines[-1]:
            lines.pop()  # behind the last line break
        first = next((line for line in lines if line.strip()), "")
        inner = next((line for line in value.value.split("\n") if line.strip()), "")
        base = _indent(first) - _indent(inner)
        moved = [f"{' ' * (indent + STEP)}{line[base:]}" if line[base:] else "" for line in lines]
        return [_INDICATOR.sub(rf"\g<1>{STEP}", head, count=1), *moved]

    def _as_it_is(self, value: SourceValue, indent: int) -> list[str]:
        """Return the lines of a text that goes on; blanks at the ends of its lines mean nothing."""
        first, *lines = self.source.written(value).split("\n")
        moved = (f"{' ' * (indent + STEP)}{line.lstrip()}" if line.strip() else "" for line in lines)
        return [each if each.rstrip().endswith("\\") else each.rstrip() for each in (first, *moved)]

    def _rows(self, value: SourceValue, indent: int, path: Path) -> list[str]:
        """Return a list in brackets over several lines, as a matrix is written, line by line."""
        rows: list[list[str]] = []
        line = -1
        for each in value.children:
            if each.last > each.line:
                return []
            if each.line != line:
                rows.append([])
                line = each.line
            rows[-1].append(self._flow(each, (*path, ELEMENT)))
        texts = [", ".join(row) for row in rows]
        if not texts:
            return []
        inner = " " * (indent + STEP)
        if value.children[0].line == value.line:
            lines = [f"[{texts[0]}", *(f"{inner}{text}" for text in texts[1:])]
        else:
            lines = ["[", *(f"{inner}{text}" for text in texts)]
        lines = [f"{each}," if 0 < number < len(lines) - 1 or (number == 0 and each != "[" and len(lines) > 1)
                 else each for number, each in enumerate(lines)]  # fmt: skip
        return [*lines[:-1], f"{lines[-1]}]"]

    def _flow(self, value: SourceValue, path: Path) -> str:
        """Return a value in brackets in one line."""
        if value.kind == SCALAR:
            return self.source.written(value)
        if value.kind == LIST:
            return f"[{', '.join(self._flow(each, (*path, ELEMENT)) for each in value.children)}]"
        pairs = _ordered(value, self.ranks, path)
        texts = (f"{self.source.written(key)}: {self._flow(each, (*path, key.value))}" for key, each in pairs)
        return f"{{{', '.join(texts)}}}"

    def _broken(self, start: str, value: SourceValue, indent: int, path: Path) -> list[str]:
        """Return a map, or a list of maps or lists, with a line for each entry, since one is too long."""
        inner = indent + STEP
        if value.kind == MAP and value.children:
            lines: list[str] = []
            for key, each in _ordered(value, self.ranks, path):
                name = f"{' ' * inner}{self.source.written(key)}:"
                lines += self._plain(name, each, inner, (*path, key.value))
        elif any(each.kind != SCALAR for each in value.children):
            lines = []
            for each in value.children:
                lines += self._plain(f"{' ' * inner}-", each, inner, (*path, ELEMENT))
        else:
            return [f"{start} {self._flow(value, path)}"]
        if not start.strip():
            return [f"{start} {self._flow(value, path)}".lstrip()]
        return [f"{start} {lines[0].lstrip()}", *lines[1:]] if start.endswith("-") else [start, *lines]

    def _comment(self, text: str, line: int) -> str:
        """Return a line with its comment, in its column if there is room."""
        comment = self.pending.get(line)
        if comment is None or comment.alone:
            return text
        del self.pending[line]
        moved = abs(len(self.source.lines[line][: comment.column].rstrip()) - len(text)) > FAR
        gap = GAP if moved else max(GAP, comment.column - len(text))
        return f"{text}{' ' * gap}{comment.text}"


def _goes_on(value: SourceValue) -> bool:
    """Return whether a text in it goes on over several lines."""
    if value.kind == SCALAR:
        return value.last > value.line
    return any(map(_goes_on, value.children))


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))
