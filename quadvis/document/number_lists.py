"""Read long lists of plain numbers as a whole, because a node for each number would take most of the time.

The lists are found in the text before it is parsed. For the parser each list is replaced by a mark of the
same length, so that no place moves. The nodes of the elements are made when the first one is read.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from quadvis.document.node import YamlNode
from quadvis.document.tree import YamlList, YamlScalar
from quadvis.units import Unit

MARK = "\ue000"
SHORTEST = 400  # characters; shorter lists are read by the parser
DEEPEST = 4

# Numbers that JSON and `units.parse_number` read alike, none near the limits of a float.
_NUMBER = r"-?(?:0|[1-9][0-9]{0,18})(?:\.[0-9]{1,20})?(?:[eE][+-]?[0-9]{1,2})?(?![0-9.eE+_-])"
_LIST = re.compile(rf"(?<![^\s\[{{,])\[(?:[\[\], \r\n]|{_NUMBER})*+")
_ELEMENT = re.compile(r"[^\[\], \r\n]+|\[|\]|\r\n|\r|\n")
_DECODER = json.JSONDecoder()


@dataclass(frozen=True)
class NumberList:
    """A list in a text: its start and end, its values as nested lists, and the number of its nodes."""

    start: int
    end: int
    values: list[Any]
    count: int


def find_lists(text: str) -> list[NumberList]:
    """Return the long lists of plain numbers of a text, in order."""
    found: list[NumberList] = []
    if len(text) < SHORTEST or MARK in text:
        return found
    for match in _LIST.finditer(text):
        if match.end() - match.start() < SHORTEST:
            continue
        try:
            values, end = _DECODER.raw_decode(text, match.start())
        except (ValueError, RecursionError):
            continue
        depth = _depth(values)
        if end - match.start() >= SHORTEST and depth and (end == len(text) or text[end] in " ,]}\r\n"):
            count = text.count(",", match.start(), end) + text.count("[", match.start(), end)
            found.append(NumberList(match.start(), end, values, count))
    return found


def _depth(values: list[Any]) -> int:
    """Return the depth of regular nested lists, 0 for other lists."""
    depth, level = 0, values
    while level:
        depth += 1
        kinds = {type(value) for value in level}
        if list not in kinds:
            return depth if depth <= DEEPEST else 0
        if kinds != {list} or len({len(value) for value in level}) != 1:
            return 0
        level = [inner for value in level for inner in value]
    return 0


def hide_lists(text: str, lists: list[NumberList]) -> str:
    """Return the text with a mark and blanks in place of each list; line breaks stay."""
    pieces, last = [], 0
    for found in lists:
        inside = re.split("([\r\n]+)", text[found.start + 1 : found.end])
        blank = "".join(piece if piece[:1] in "\r\n" else " " * len(piece) for piece in inside)
        pieces += [text[last : found.start], MARK, blank]
        last = found.end
    return "".join([*pieces, text[last:]])


class Numbers(YamlList):
    """A regular list of numbers, with one unit for all numbers or one for each along the last axis.

    ``element_units`` is empty if the text has no units; ``numbers`` are nested lists of int and float.
    """

    __slots__ = ("element_units", "numbers", "source")

    def __init__(
        self,
        found: NumberList,
        text: str,
        file: str,
        line: int,
        column: int,
        key: str = "",
        units: tuple[Unit, ...] = (),
    ) -> None:
        super().__init__([], file, line, column, key)
        self.source, self.numbers, self.element_units = text, found.values, units
        self._values = None

    def with_units(self, units: tuple[Unit, ...], key: str) -> Numbers:
        """Return the same list under another key, with units after its numbers."""
        found = NumberList(0, 0, self.numbers, 0)
        return Numbers(found, self.source, self.file, self.line, self.column, key, units)

    def shape(self) -> tuple[int, ...]:
        """Return the sizes along the axes."""
        sizes, level = [], self.numbers
        while isinstance(level, list):
            sizes.append(len(level))
            level = level[0]
        return tuple(sizes)

    def flat(self) -> list[Any]:
        """Return the numbers, row by row."""
        level = self.numbers
        while isinstance(level[0], list):
            level = [inner for value in level for inner in value]
        return level

    def to_python(self) -> Any:
        """Return the list of plain values."""
        return self.numbers if not self.element_units else super().to_python()

    def _make(self) -> list[YamlNode]:
        """Make the nodes of all elements, with their places."""
        stack: list[tuple[YamlList, list[YamlNode]]] = []
        line, start = self.line, -(self.column - 1)  # offset of the line's beginning in the list's text
        written = 0
        for match in _ELEMENT.finditer(self.source):
            token, column = match.group(), match.start() - start + 1
            if token in ("\r\n", "\r", "\n"):
                line, start = line + 1, match.end()
                continue
            if token == "]":
                _, values = stack.pop()
                if not stack:
                    return values
                continue
            outer, siblings = stack[-1] if stack else (self, list[YamlNode]())
            key = f"{outer.key}[{len(siblings)}]" if stack else self.key
            if token == "[":
                values = []
                inner = YamlList(values, self.file, line, column, key) if stack else self
                siblings.append(inner)
                stack.append((inner, values))
                continue
            if self.element_units:
                unit = self.element_units[written % len(self.element_units)]
                token = f"{token} {unit}" if unit.symbols else token
            written += 1
            siblings.append(YamlScalar(token, True, self.file, line, column, key))
        raise AssertionError("a list ends with its bracket")


def numbers_in(lists: list[NumberList], text: str) -> Iterator[tuple[tuple[int, int], NumberList, str]]:
    """Yield each list under its line and column, from 0, with its text."""
    line = column_start = last = 0
    breaks = re.compile("\r\n|\r|\n")
    for found in lists:
        for match in breaks.finditer(text, last, found.start):
            line, column_start = line + 1, match.end()
        last = found.start
        yield (line, found.start - column_start), found, text[found.start : found.end]
