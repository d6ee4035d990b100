"""Decide which files a message may quote: a diagram from elsewhere may name any file, but must not show it.

While a diagram is loaded, messages quote only files in its own folder and files that its user named. For
other files they give places, with dots in place of every text from the file.
"""

from __future__ import annotations

import ast
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

LARGEST = 1_000_000  # bytes; larger files are never read for a diagram
DOTS = "'...'"
_SEGMENT = re.compile(r"'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"|\{value:.*\}")
_OWN_WORDS = re.compile(r"[\w./: -]{0,40}", re.ASCII)
_allowed: ContextVar[tuple[str, ...] | None] = ContextVar("allowed", default=None)


@contextmanager
def quoting_only(paths: Iterable[str | os.PathLike[str]]) -> Iterator[None]:
    """Let messages quote only these files, and the files in these folders."""
    token = _allowed.set(tuple(os.path.realpath(path) for path in paths))
    try:
        yield
    finally:
        _allowed.reset(token)


def is_foreign(file: str) -> bool:
    """Return whether a file must not be quoted."""
    allowed = _allowed.get()
    if allowed is None:
        return False
    try:
        real = os.path.realpath(file)
    except (OSError, ValueError):
        return False
    return not any(real == path or real.startswith(path.rstrip(os.sep) + os.sep) for path in allowed)


def without_quotes(words: str, file: str) -> str:
    """Return a message with dots in place of every text from a file."""
    text = _text(file)

    def shown(match: re.Match[str]) -> str:
        segment = match.group()
        if segment[0] == "{":
            return "{...}"
        try:
            inner = str(ast.literal_eval(segment))
        except (ValueError, SyntaxError):
            inner = segment[1:-1]
        plain = "".join(inner.removesuffix("...").split())
        is_ours = text is not None and plain not in text and _OWN_WORDS.fullmatch(inner) is not None
        return segment if is_ours else DOTS

    return _SEGMENT.sub(shown, words)


def _text(file: str) -> str | None:
    """Return the contents of a file without blanks, because messages show texts with other blanks."""
    try:
        if not os.path.isfile(file):
            return None
        with open(file, encoding="utf-8", errors="replace") as stream:
            return "".join(stream.read(LARGEST).split())
    except (OSError, ValueError):
        return None
