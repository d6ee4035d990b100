"""Markdown from what the code says: docstrings as paragraphs, rows as tables."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_CODE = re.compile(r"(``.+?``|`[^`]+`)", re.DOTALL)
_RULE = re.compile(r"=+(?: +=+)+")  # above, in and below a table of a docstring
_SPECIAL = re.compile(r"([*_\[\]<>|#])")


def from_docstring(text: str) -> str:
    """Return a docstring as Markdown: ``::`` introduces code, rules of ``=`` a table, all else is text."""
    parts, found = re.split(r"\n{2,}", text), []
    literal = False
    for part in parts:
        if literal and part.startswith((" ", "\t")):
            found.append(f"```text\n{_outdented(part)}\n```")
            continue
        literal = part.endswith("::")
        if _RULE.fullmatch(part.partition("\n")[0]):
            found.append(_ruled_table(part.splitlines()))
            continue
        found.append(escaped(part[:-1] if literal else part))
    return "\n\n".join(found)


def escaped(text: str) -> str:
    """Return a text such that Markdown shows it as it is, with its code in backticks."""
    spans = _CODE.split(text)
    return "".join(span if number % 2 else _SPECIAL.sub(r"\\\1", span) for number, span in enumerate(spans))


def code(text: str) -> str:
    """Return a text as code in a line; "" stays empty."""
    return f"`{text}`" if text else ""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table whose cells are Markdown; columns that are empty in all rows are left out."""
    listed = list(rows)
    kept = [number for number in range(len(head)) if any(row[number] for row in listed)]
    lines = [[head[number] for number in kept], ["---"] * len(kept)]
    lines += [[_cell(row[number]) for number in kept] for row in listed]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _ruled_table(lines: Sequence[str]) -> str:
    """Return a table whose columns are those of the rules; a line that fills one column continues its row."""
    columns = [match.span() for match in re.finditer("=+", lines[0])]
    starts = [start for start, _ in columns]
    rows: list[list[str]] = []
    for line in lines[1:]:
        if _RULE.fullmatch(line):
            continue
        cells = [line[a:b].strip() for a, b in zip(starts, [*starts[1:], None], strict=True)]
        if len(rows) > 1 and sum(map(bool, cells)) == 1:
            rows[-1] = [f"{before} {more}".strip() for before, more in zip(rows[-1], cells, strict=True)]
        else:
            rows.append(cells)
    head, *body = [[escaped(cell) for cell in row] for row in rows]
    return table(head, body)


def _cell(text: str) -> str:
    """Return a text for a cell: on one line, with bars that divide nothing."""
    return re.sub(r"(?<!\\)\|", r"\\|", " ".join(text.split()))


def _outdented(text: str) -> str:
    lines = text.splitlines()
    margin = min(len(line) - len(line.lstrip()) for line in lines if line.strip())
    return "\n".join(line[margin:] for line in lines)
