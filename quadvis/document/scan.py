"""Scan a text that a YAML parser refused: find the beginnings and ends of quotes, brackets and levels.

The scan is never used for right texts, and knows just enough of YAML to explain wrong ones.
"""

from __future__ import annotations

import re
from bisect import bisect_right

_SINGLE = re.compile(r"'(?:[^']|'')*+('?)")
_DOUBLE = re.compile(r'"(?:[^"\\]|\\.)*+("?)', re.DOTALL)
# These patterns never backtrack, so hostile texts cost no more than others.
_PLAIN_BLOCK = re.compile(r"(?:[^\s:#]|:(?=\S)|(?<!\s)#|[ \t]++(?![\s#]))*+")
_PLAIN_FLOW = re.compile(r"(?:[^\s:#,\[\]{}]|:(?=[^\s,\[\]{}])|(?<!\s)#|[ \t]++(?![\s#,\[\]{}]))*+")
_BREAK = re.compile("\r\n|\r|\n")
_COMMENT = re.compile(r"[^\r\n]*")
_INDENT = re.compile(r"[ \t]*")
_MARKER = re.compile(r"[-?](?=[ \t\r\n]|$)[ \t]*")
_KEY = re.compile(
    r"""(?:'(?:[^'\r\n]|'')*+'|"(?:[^"\\\r\n]|\\.)*+"|[^\s'"\[{:](?:[^:\r\n]|:(?=\S))*+)[ \t]*+:(?=\s|$)"""
)


class Scan:
    """The structure of a text; ``at`` is the offset at which the parser stopped.

    ``quotes`` and ``brackets`` hold the start and end of closed ones; ``hidden`` holds quotes, comments and
    ``|`` texts. ``open_quote`` is a quote that is never closed; ``open`` are the brackets around ``at``,
    outermost first; ``deep`` is the first offset that is nested deeper than ``limit``.
    """

    def __init__(self, text: str, at: int, limit: int) -> None:
        self.text, self.at, self.limit = text, at, limit
        self.starts = [0, *(match.end() for match in _BREAK.finditer(text))]
        self.quotes: list[tuple[int, int]] = []
        self.brackets: list[tuple[int, int]] = []
        self.hidden: list[tuple[int, int]] = []
        self.open_quote: int | None = None
        self.open: list[int] | None = None  # set when the scan reaches ``at``
        self.deep: int | None = None
        self._flow: list[int] = []
        self._levels: list[tuple[int, str]] = []
        self._run()
        if self.open is None:
            self.open = list(self._flow)

    def line(self, at: int) -> int:
        """Return the number of the line of an offset, from 0."""
        return bisect_right(self.starts, at) - 1

    def line_text(self, number: int) -> str:
        """Return a line without its line break."""
        end = self.starts[number + 1] if number + 1 < len(self.starts) else len(self.text)
        return self.text[self.starts[number] : end].rstrip("\r\n")

    def is_hidden(self, at: int) -> bool:
        """Return whether an offset lies in a comment, in a text in quotes, or in a ``|`` text."""
        index = bisect_right(self.hidden, (at, len(self.text) + 1)) - 1
        return index >= 0 and self.hidden[index][0] <= at < self.hidden[index][1]

    def _enter(self, at: int) -> None:
        if self.deep is None and len(self._levels) + len(self._flow) > self.limit:
            self.deep = at

    def _run(self) -> None:
        text, pos, fresh, new_line = self.text, 0, True, True
        while pos < len(text):
            if self.open is None and pos >= self.at:
                self.open = list(self._flow)
            if new_line and not self._flow:
                pos, fresh = self._line_start(pos), True
                new_line = False
                continue
            new_line = False
            char = text[pos]
            if char in " \t":
                pos += 1
            elif char in "\r\n":
                pos, new_line = pos + 1, True
                fresh = fresh or not self._flow
            elif char == "#" and (pos == 0 or text[pos - 1] in " \t\r\n"):
                pos = self._hide(pos, _COMMENT.match(text, pos))
            elif char in "'\"" and fresh:
                match = (_SINGLE if char == "'" else _DOUBLE).match(text, pos)
                assert match is not None
                if not match[1]:
                    self.open_quote = pos
                    return
                self.quotes.append(match.span())
                pos, fresh = self._hide(pos, match), False
            elif char in "[{" and (fresh or self._flow):
                self._flow.append(pos)
                self._enter(pos)
                pos, fresh = pos + 1, True
            elif char in "]}" and self._flow:
                self.brackets.append((self._flow.pop(), pos + 1))
                pos, fresh = pos + 1, False
            elif self._is_separator(pos):
                pos, fresh = pos + 1, True
            elif char in "|>" and fresh and not self._flow:
                pos, new_line = self._block_text(pos), True
            else:
                match = (_PLAIN_FLOW if self._flow else _PLAIN_BLOCK).match(text, pos)
                pos, fresh = max(match.end() if match else 0, pos + 1), False

    def _is_separator(self, pos: int) -> bool:
        """Return whether a ',' or ':' is a separator and not a part of a plain text."""
        text, flow = self.text, bool(self._flow)
        return (text[pos] == "," and flow) or (
            text[pos] == ":" and text[pos + 1 : pos + 2] in _after_colon(flow)
        )

    def _hide(self, start: int, match: re.Match[str] | None) -> int:
        end = match.end() if match is not None else start + 1
        self.hidden.append((start, end))
        return end

    def _line_start(self, pos: int) -> int:
        """Skip the indentation and each ``- `` that begins a list; keep the level of the line."""
        text = self.text
        match = _INDENT.match(text, pos)
        start, pos = pos, match.end() if match else pos
        if text[pos : pos + 1] in ("", "\r", "\n", "#"):
            return pos
        first = True
        while (marker := _MARKER.match(text, pos)) is not None:
            self._level(pos - start, text[pos], pos, first)
            pos, first = marker.end(), False
        if _KEY.match(text, pos):
            self._level(pos - start, "key", pos, first)
        elif first:
            while self._levels and self._levels[-1][0] > pos - start:
                self._levels.pop()
        return pos

    def _level(self, column: int, kind: str, at: int, first: bool) -> None:
        level = column, "-" if kind == "-" else "key"
        while first and self._levels and self._levels[-1] != level and self._levels[-1][0] >= column:
            if self._levels[-1] == (column, "key") and kind == "-":
                break
            self._levels.pop()
        if not self._levels or self._levels[-1] != level:
            self._levels.append(level)
            self._enter(at)

    def _block_text(self, pos: int) -> int:
        """Skip a text after ``|`` or ``>``: all lines that are indented deeper than its key."""
        outer = self._levels[-1][0] if self._levels else -1
        number = self.line(pos) + 1
        while number < len(self.starts):
            line = self.line_text(number)
            if line.strip() and len(line) - len(line.lstrip(" ")) <= outer:
                break
            number += 1
        end = self.starts[number] if number < len(self.starts) else len(self.text)
        first = self.starts[self.line(pos) + 1] if self.line(pos) + 1 < len(self.starts) else end
        self.hidden.append((first, end))
        return end


def _after_colon(flow: bool) -> tuple[str, ...]:
    return ("", " ", "\t", "\r", "\n", ",", "[", "]", "{", "}") if flow else ("", " ", "\t", "\r", "\n")
