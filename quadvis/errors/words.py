"""How messages are put together: problem and remedy, quoted texts, always one line."""

from __future__ import annotations


def sentence(problem: str, remedy: str = "") -> str:
    """Join what is wrong and what would be right."""
    return f"{problem}; {remedy}" if remedy else problem


def on_one_line(text: str) -> str:
    """Return a text with everything written out that does not show, or would begin a new line."""
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def quoted(text: object, limit: int = 40) -> str:
    """Return the text in quotes, fit for one line of a message: escaped and shortened."""
    raw = str(text)
    return repr(raw if len(raw) <= limit else raw[: limit - 3] + "...")
