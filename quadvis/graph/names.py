"""Names of signals as texts: ``pose.position``, ``eyes/camera.centres[2,1]``, ``a.y[:2]``.

The grammar stands here alone: diagrams, logs, figures and the JSON schema read names by it.
"""

from __future__ import annotations

import re

from quadvis.graph.graph import Index, Wire

PATH, PORT = r"[A-Za-z_][\w/]*", r"[A-Za-z_]\w*"
PATTERN = rf"({PATH})\.({PORT})(\[([\d:,\s]*)\])?"  # block, port, index in brackets, index
_NAME = re.compile(PATTERN, re.ASCII)
_BOUNDS = re.compile(r"\s*(?P<first>\d{1,6})?\s*(?P<slice>:\s*(?P<last>\d{1,6})?\s*)?", re.ASCII)


def read_name(text: str) -> Wire | None:
    """Return the source of a wire that a name means; None if it is no name of a signal."""
    match = _NAME.fullmatch(text)
    if match is None:
        return None
    block, port, brackets, inside = match.groups()
    index = read_index(inside) if brackets else ()
    return None if index is None else Wire(block, port, index)


def read_index(text: str) -> Index | None:
    """Read ``0``, ``2,1``, ``0:2``, ``1:`` or ``:``; None if it is no index."""
    parts: list[int | slice] = []
    for part in text.split(","):
        bounds = _BOUNDS.fullmatch(part)
        if bounds is None or (bounds["slice"] is None and bounds["first"] is None):
            return None
        first, last = (int(bounds[name]) if bounds[name] else None for name in ("first", "last"))
        parts.append(int(bounds["first"]) if bounds["slice"] is None else slice(first, last))
    return tuple(parts)


def split_names(text: str) -> list[str]:
    """Return the names in a text that are divided by commas; those inside of indices do not divide."""
    parts = [""]
    depth = 0
    for letter in text:
        depth += (letter == "[") - (letter == "]")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def index_text(index: Index) -> str:
    """Return an index as a diagram writes it."""
    parts = [_slice_text(part) if isinstance(part, slice) else str(part) for part in index]
    return f"[{','.join(parts)}]" if parts else ""


def _slice_text(part: slice) -> str:
    first, last = ("" if bound is None else str(bound) for bound in (part.start, part.stop))
    return f"{first}:{last}"


def wire_text(wire: Wire) -> str:
    """Return where a wire comes from, as a diagram writes it."""
    return wire.source + index_text(wire.index)
