"""A YAML file with a line for each value, its keys before it: so git's own diff says what changed where."""

from __future__ import annotations

from collections.abc import Iterator

from quadvis.document.source import MAP, SCALAR, SourceText, SourceValue
from quadvis.errors import DiagramError

LONGEST = 60  # characters of a list of plain values in one line


def flat_text(text: str) -> str:
    """Return the values of a text, a line for each; a text that is no YAML as it is."""
    try:
        source = SourceText(text)
    except DiagramError:
        return text
    return "".join(f"{line}\n" for line in _lines(source, source.root, ""))


def _lines(source: SourceText, value: SourceValue, path: str) -> Iterator[str]:
    if value.kind == MAP and value.children:
        for key, each in value.pairs:
            yield from _lines(source, each, f"{path}.{key.value}" if path else key.value)
    elif value.kind == SCALAR or not value.children:
        yield f"{path}: {plain(source, value)}"
    elif len(whole := plain(source, value)) <= LONGEST and all(
        each.kind == SCALAR for each in value.children
    ):
        yield f"{path}: {whole}"
    else:
        for number, each in enumerate(value.children):
            yield from _lines(source, each, f"{path}[{number}]")


def plain(source: SourceText, value: SourceValue) -> str:
    """Return a value in one line, without comments."""
    if value.kind == SCALAR:
        return " ".join(source.written(value).split())
    if value.kind == MAP:
        texts = (f"{source.written(key)}: {plain(source, each)}" for key, each in value.pairs)
        return f"{{{', '.join(texts)}}}"
    return f"[{', '.join(plain(source, each) for each in value.children)}]"
