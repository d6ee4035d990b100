"""Compose nodes from the events of a YAML parser, without recursion, and collect the faults."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from yaml import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

from quadvis.document.damage import ORIGINALS
from quadvis.document.keys import mend_fraction, refuse_repeated, split_pair, wrong_key
from quadvis.document.node import YamlNode
from quadvis.document.number_lists import MARK, NumberList, Numbers, numbers_in
from quadvis.document.tree import YamlList, YamlMap, YamlScalar
from quadvis.errors import DiagramError, Fault, Faults, Odd, Place, quoted
from quadvis.errors.characters import (
    NAMELESS,
    character_name,
    odd_characters,
)

# A diagram has a value in about 7 characters. Many more values than that would cost more memory than the
# length of the file explains.
MAX_NODES, LEAST_CHARACTERS = 100_000, 4
MAX_DEPTH = 50
# Repeated keys of a map, after which the rest of the file is not read: it takes long and says no more.
MOST_REPEATED = 1000

# Control characters, line breaks that editors do not count, and signs that reorder the visible text.
FORBIDDEN = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff"
    "\ufffe\uffff]"
)
LINE_END = re.compile("\r\n|\r|\n")
# In a block, a beginning list or map, or a blank that YAML does not know, makes the key go on after its ':'.
_RUN_ON = re.compile("[A-Za-z_][A-Za-z0-9_]*:(?=[{\\[\u00a0\u1680\u2000-\u200a\u202f\u205f\u3000])")


class MisreadError(Exception):
    """A list of numbers was part of a longer text, or was too long."""


class RunOnError(Exception):
    """A key goes on after its ':' at this line and column, from 0."""

    def __init__(self, line: int, column: int) -> None:
        super().__init__(line, column)
        self.line, self.column = line, column


class Position:
    """Converts lines and columns of the parser, from 0, to places; ``blanks`` were inserted by repairs."""

    def __init__(self, name: str, blanks: list[tuple[int, int]]) -> None:
        self.name, self.blanks = name, blanks

    def of(self, line: int, column: int) -> tuple[str, int, int]:
        """Return file, line and column."""
        moved = sum(line == other and column > start for other, start in self.blanks)
        return self.name, line + 1, column + 1 - moved

    def of_event(self, event: Any) -> tuple[str, int, int]:
        """Return where an event of the parser begins."""
        mark = event.start_mark
        if self.blanks:
            return self.of(mark.line, mark.column)
        return self.name, mark.line + 1, mark.column + 1


@dataclass
class _Level:
    """An incomplete list or map, with the key that waits for its value, and its repeated keys."""

    node: YamlList | YamlMap
    is_flow: bool
    key: YamlScalar | None = None
    doubles: list[tuple[YamlScalar, YamlNode]] = field(default_factory=list)
    in_key: bool = False  # it stands in place of a key; this fault has been reported


class Composer:
    """Builds nodes from events on its own stack."""

    def __init__(
        self,
        position: Position,
        faults: Faults,
        text: str,
        lists: list[NumberList] | None = None,
        *,
        repaired: bool = False,
    ) -> None:
        self.position, self.faults, self.text, self.repaired = position, faults, text, repaired
        self.is_ascii = text.isascii() and "\t" not in text and not lists
        self.lists = {at: (found, source) for at, found, source in numbers_in(lists or [], text)}
        self.stack: list[_Level] = []
        self.root: YamlNode | None = None
        self.documents = self.nodes = 0
        self.most = max(MAX_NODES, len(text) // LEAST_CHARACTERS)

    def compose(self, events: Iterator[Any]) -> YamlNode:
        """Return the root; raise an error for an empty file."""
        for event in events:
            kind = type(event)
            if kind is ScalarEvent:
                if event.style == '"':
                    self._check_escapes(event)
                self._add(self._scalar(event), event)
            elif kind is MappingStartEvent:
                self._open(YamlMap({}, {}, *self.position.of_event(event)), event)
            elif kind is SequenceStartEvent:
                self._open(YamlList([], *self.position.of_event(event)), event)
            elif kind is MappingEndEvent or kind is SequenceEndEvent:
                self._close()
            elif kind is AliasEvent:
                self._refuse(event, f"the alias {quoted('*' + event.anchor)} is not allowed", "write it out")
                self._add(YamlScalar("", True, *self.position.of_event(event)), event)
            elif kind is DocumentStartEvent:
                self.documents += 1
                if self.documents > 1:
                    raise self._fatal(event, "a second document begins here", "keep one document in a file")
        if self.root is None or (
            isinstance(self.root, YamlScalar) and self.root.plain and not self.root.value
        ):
            raise DiagramError(
                [*self.faults, Fault(Place(self.position.name, 1, 1), "", "the file is empty")]
            )
        return self.root

    def _scalar(self, event: Any) -> YamlScalar | Numbers:
        value, plain = event.value, not event.style
        if self.is_ascii:
            return YamlScalar(value, plain, *self.position.of_event(event))
        if self.lists and MARK in value:
            mark = event.start_mark
            if value != MARK or not plain or (mark.line, mark.column) not in self.lists:
                raise MisreadError
            found, source = self.lists[mark.line, mark.column]
            self.nodes += found.count
            if self.nodes >= self.most:
                raise MisreadError  # read it again element by element, to find where it exceeds the limit
            return Numbers(found, source, *self.position.of_event(event))
        if value.isascii() and "\t" not in value:
            return YamlScalar(value, plain, *self.position.of_event(event))
        if self.repaired:
            value = value.translate(ORIGINALS)
        return YamlScalar(value, plain, *self.position.of_event(event), odd=self._odd(event))

    def _odd(self, event: Any) -> Odd | None:
        """Return the first character of a text that looks like an ASCII one, with its place."""
        if event.style in ("|", ">"):
            return None
        start, end = event.start_mark, event.end_mark
        for number, line in enumerate(self.lines[start.line : end.line + 1], start.line):
            first = start.column if number == start.line else 0
            last = end.column if number == end.line else len(line)
            for column, char in odd_characters(line, first, last):
                if char != "\t" or line[:column].strip():
                    return Odd(*self.position.of(number, column)[1:], char)
        return None

    @cached_property
    def lines(self) -> list[str]:
        """The lines of the text, without their ends."""
        return LINE_END.split(self.text)

    def _refuse(self, event: Any, problem: str, remedy: str) -> None:
        self.faults.add(Place(*self.position.of_event(event)), problem, remedy)

    def _fatal(self, event: Any, problem: str, remedy: str) -> DiagramError:
        return DiagramError([*self.faults, Fault(Place(*self.position.of_event(event)), "", problem, remedy)])

    def _open(self, node: YamlList | YamlMap, event: Any) -> None:
        self._add(node, event)
        if len(self.stack) >= MAX_DEPTH:
            raise self._fatal(event, f"this is nested deeper than {MAX_DEPTH} levels", "write it flatter")
        outer = self.stack[-1] if self.stack else None
        in_key = outer is not None and (outer.in_key or outer.key is _NO_KEY)
        self.stack.append(_Level(node, bool(event.flow_style), in_key=in_key))

    def _close(self) -> None:
        level = self.stack.pop()
        if level.doubles:
            assert isinstance(level.node, YamlMap)
            refuse_repeated(level.node, level.doubles, self.faults)

    def _add(self, node: YamlNode, event: Any) -> None:
        """Put a node in its place: under the waiting key, at the end of the list, or as a key itself."""
        self.nodes += 1
        if self.nodes > self.most:
            raise self._fatal(event, f"the file holds more than {self.most} values", "split it")
        if event.anchor is not None or event.tag is not None:
            self._refuse_properties(event)
        if not self.stack:
            self.root = node
            return
        level = self.stack[-1]
        parent = level.node
        if isinstance(parent, YamlList):
            node.key = f"{parent.key}[{len(parent.values)}]"
            parent.values.append(node)
        elif level.key is None:
            level.key = self._key(node, event)
        else:
            key, level.key = level.key, None
            if key is not _NO_KEY:
                self._put(level, parent, key, node)

    def _put(self, level: _Level, parent: YamlMap, key: YamlScalar, node: YamlNode) -> None:
        """Put a value under its key; a key without a value in ``{}`` may be a slip with ':' or ','."""
        if level.is_flow and key.plain and isinstance(node, YamlScalar) and node.plain and not node.value:
            if mend_fraction(parent, key, self.faults):
                return
            key, node = split_pair(key, node, self.faults)
        node.key = key.value
        if key.value in parent.keys:
            level.doubles.append((key, node))
            if len(level.doubles) > MOST_REPEATED:
                raise self._repeated(parent, level.doubles)
        else:
            parent.keys[key.value], parent.values[key.value] = key, node

    def _repeated(self, parent: YamlMap, doubles: list[tuple[YamlScalar, YamlNode]]) -> DiagramError:
        """Return the faults of a map that is not worth being read to its end."""
        refuse_repeated(parent, doubles, self.faults)
        place = doubles[-1][0].place
        problem = f"more than {MOST_REPEATED} keys of one map are repeated"
        return DiagramError([*self.faults, Fault(place, "", problem, "keep one of each")])

    def _check_escapes(self, event: Any) -> None:
        escaped = FORBIDDEN.search(event.value)
        if escaped is not None:
            problem, remedy = forbidden(escaped)
            if ord(escaped.group()) < 0x20:
                remedy = "write '/' between folders, and '\\\\' for '\\' in double quotes"
            self._refuse(event, problem, remedy)

    def _refuse_properties(self, event: Any) -> None:
        if type(event) is AliasEvent:  # it has been refused
            return
        if event.anchor is not None:
            self._refuse(event, f"the anchor {quoted('&' + event.anchor)} is not allowed", "leave it out")
        if event.tag is not None:
            remedy = "leave it out, or put a text that begins with '!' in quotes"
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            self._refuse(event, f"the tag {quoted(tag)} is not allowed", remedy)

    def _key(self, node: YamlNode, event: Any) -> YamlScalar:
        """Return the key for the next value, or `_NO_KEY` if the key is refused."""
        if type(event) is AliasEvent:
            return _NO_KEY
        problem, remedy = wrong_key(node)
        if isinstance(node, YamlScalar) and not problem:
            if node.plain and ":" in node.value and not self.stack[-1].is_flow:
                self._check_run_on(node, event)
            return node
        if not self.stack[-1].in_key:
            self._refuse(event, problem, remedy)
        return _NO_KEY

    def _check_run_on(self, key: YamlScalar, event: Any) -> None:
        match = _RUN_ON.match(key.value)
        if match is not None:
            mark = event.start_mark
            raise RunOnError(mark.line, mark.column + match.end())


def forbidden(found: re.Match[str]) -> tuple[str, str]:
    """Return the problem and the remedy for a forbidden character."""
    char = found.group()
    name = character_name(char).partition(" (")[0]
    remedy = "remove it" if name == NAMELESS else f"remove this {name}"
    return f"the control character U+{ord(char):04X} is not allowed", remedy


_NO_KEY = YamlScalar("", True, "", 0, 0)
