"""The parts of messages: problem and remedy, quoted texts, counts, always on one line."""

from __future__ import annotations


def sentence(problem: str, remedy: str = "") -> str:
    """Join a problem and its remedy."""
    return f"{problem}; {remedy}" if remedy else problem


def counted(count: int, word: str) -> str:
    """Return "1 row", "2 rows", "0 rows"."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def on_one_line(text: str) -> str:
    """Return a text with escapes for line breaks and for all characters that do not show."""
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def quoted(text: object, limit: int = 40) -> str:
    """Return the text in quotes, fit for one line of a message: escaped and shortened."""
    raw = str(text)
    return repr(raw if len(raw) <= limit else raw[: limit - 3] + "...")
