"""Tables of text for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

LEAST = 20  # least width in characters of the last column, even on a narrow terminal


def table(rows: Sequence[Sequence[str]], width: int | None = None) -> list[str]:
    """Return lines with aligned columns; empty columns are left out, the last wraps at the width."""
    if not rows:
        return []
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    kept = [column for column, found in enumerate(widths) if found]
    lines = []
    for row in rows:
        head = "".join(row[column].ljust(widths[column]) + "  " for column in kept[:-1])
        last = row[kept[-1]] if kept else ""
        parts = textwrap.wrap(last, max(LEAST, width - len(head))) if width and last else [last]
        lines += [
            ((" " * len(head) if number else head) + part).rstrip() for number, part in enumerate(parts)
        ]
    return lines
