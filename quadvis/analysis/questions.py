"""Read the cuts, transfers and limits of the command line."""

from __future__ import annotations

from collections.abc import Sequence

from quadvis.diagram.times import read_duration
from quadvis.document import YamlScalar
from quadvis.errors import QuadvisError
from quadvis.graph.names import split_names


def read_cuts(texts: Sequence[str]) -> dict[str, list[str]]:
    """Read ``torque=control/roll.torque``, or ``a.y,b.y``, which is also the name of the cut or transfer."""
    found: dict[str, list[str]] = {}
    for text in texts:
        name, equals, signals = text.partition("=")
        if not equals:
            name, signals = text, text
        found[name.strip()] = split_names(signals)
    return found


def read_limits(texts: Sequence[str]) -> dict[str, tuple[str, str, str]]:
    """Read ``eyes/camera.latency=100 ms..2 s``; QuadvisError for any other text."""
    found = {}
    for text in texts:
        name, _, span = (part.strip() for part in text.partition("="))
        start, dots, end = (part.strip() for part in span.partition(".."))
        if not name or not dots or not start or not end:
            remedy = "write a parameter and its range, such as eyes/camera.latency='100 ms..2 s'"
            raise QuadvisError(f"--vary: '{text}' is not understood; {remedy}")
        found[name] = (name, start, end)
    return found


def read_time(text: str | None) -> float | None:
    """Read ``5 s``; DiagramError if the text is not a time."""
    return None if text is None else float(read_duration(YamlScalar(text, False, "--at", 0, 0)))
