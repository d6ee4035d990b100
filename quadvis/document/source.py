"""The text of a YAML file with the places of its values: what changes a file and keeps all the rest of it.

`YamlNode` says what a file means; this says where each value stands, how, and which lines are comments. Only
a text that `parse_yaml` takes is read: so there are no anchors, tags and aliases, and keys are texts.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml
from yaml import MappingEndEvent, MappingStartEvent, ScalarEvent, SequenceEndEvent, SequenceStartEvent

from quadvis.document.reader import parse_yaml

MAP, LIST, SCALAR = "map", "list", "scalar"
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_COMMENT = re.compile(r"(?:^|(?<=[ \t]))#.*", re.MULTILINE)
_ENDS = re.compile("\r\n|\r")


@dataclass
class SourceValue:
    """A value in a text, from ``start`` to ``end``; the children of a map are keys and values in turn.

    ``line``, ``last`` are its first and its last line, from 0; ``flow`` says that a map or list has brackets.
    """

    kind: str
    start: int
    line: int
    column: int
    flow: bool = False
    end: int = 0
    last: int = 0
    value: str = ""
    style: str = ""
    children: list[SourceValue] = field(default_factory=list)

    @property
    def pairs(self) -> list[tuple[SourceValue, SourceValue]]:
        """The keys and values of a map, in the order of the text."""
        return list(zip(self.children[::2], self.children[1::2], strict=True))

    @property
    def is_block(self) -> bool:
        """Whether it is a map or a list with a line for each entry."""
        return self.kind != SCALAR and not self.flow


@dataclass(frozen=True)
class Comment:
    """A comment with its column; ``alone`` says that nothing else stands in its line."""

    text: str
    column: int
    alone: bool


class SourceText:
    """A whole text: its lines, its root value, and its comments by line."""

    def __init__(self, text: str, name: str = "<text>") -> None:
        """Read a text; DiagramError if it is none that quadvis takes."""
        parse_yaml(text, name)
        self.text = _ENDS.sub("\n", text.removeprefix("\ufeff"))
        self.lines = self.text.split("\n")
        self._starts = [0]
        for line in self.lines:
            self._starts.append(self._starts[-1] + len(line) + 1)
        self._scalars: list[tuple[int, int]] = []
        self.root = self._read()
        self.comments = dict(self._comments())

    def written(self, value: SourceValue) -> str:
        """Return a value as it stands in the text."""
        return self.text[value.start : value.end]

    def is_blank(self, line: int) -> bool:
        """Return whether a line is empty."""
        return not self.lines[line].strip()

    def _offset(self, mark: Any) -> int:
        line, column = int(mark.line), int(mark.column)
        return min(self._starts[min(line, len(self.lines))] + column, len(self.text))

    def _read(self) -> SourceValue:
        loader = _Loader(self.text)
        stack: list[SourceValue] = []
        root: SourceValue | None = None
        for event in iter(loader.get_event, None):
            if isinstance(event, MappingEndEvent | SequenceEndEvent):
                self._close(stack.pop(), event)
            elif isinstance(event, ScalarEvent | MappingStartEvent | SequenceStartEvent):
                made = self._value(event)
                if stack:
                    stack[-1].children.append(made)
                root = root or made
                if made.kind != SCALAR:
                    stack.append(made)
        assert root is not None, "an empty text is refused"
        return root

    def _value(self, event: Any) -> SourceValue:
        mark = event.start_mark
        kind = (
            SCALAR
            if isinstance(event, ScalarEvent)
            else MAP
            if isinstance(event, MappingStartEvent)
            else LIST
        )
        made = SourceValue(kind, self._offset(mark), mark.line, mark.column)
        if kind == SCALAR:
            made.value, made.style, made.end = event.value, event.style or "", self._offset(event.end_mark)
            head = self.text[made.start : made.end].partition("\n")[0]
            if made.style in ("|", ">") and "+" not in head:
                made.end = made.start + len(self.text[made.start : made.end].rstrip())
            made.last = self._line(made.end)
            self._scalars.append((made.start, made.end))
        else:
            made.flow = bool(event.flow_style)
        return made

    def _close(self, value: SourceValue, event: Any) -> None:
        """Set the end of a map or list; one in blocks ends where its last entry ends."""
        inner = value.children[-1].end if value.children else value.start
        value.end = self._offset(event.end_mark) if value.flow else inner
        value.last = self._line(value.end)

    def _line(self, offset: int) -> int:
        """Return the line of the character before an offset."""
        return max(0, bisect_right(self._starts, max(0, offset - 1)) - 1)

    def _comments(self) -> Iterator[tuple[int, Comment]]:
        begins = [start for start, _ in self._scalars]
        for match in _COMMENT.finditer(self.text):
            before = bisect_right(begins, match.start()) - 1
            if before >= 0 and match.start() < self._scalars[before][1]:
                continue
            line = bisect_right(self._starts, match.start()) - 1
            column = match.start() - self._starts[line]
            alone = not self.lines[line][:column].strip()
            yield line, Comment(match.group().rstrip(), column, alone)
