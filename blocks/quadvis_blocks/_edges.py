"""Edges of truth values. What is true at the start is no edge, here and in every block."""

from __future__ import annotations

RISING, FALLING, EITHER, LEVEL = EDGES = range(4)
NAMES = ("rising", "falling", "either", "level")


def fires(edge: int, now: bool, before: bool, seen: bool) -> bool:
    """Return whether a truth value has the wanted edge; with ``LEVEL``, whether it is true.

    ``before`` is its value at the tick before, which counts if there was one: ``seen``.
    """
    if edge == LEVEL:
        return now
    if not seen or now == before:
        return False
    return edge == EITHER or now == (edge == RISING)
