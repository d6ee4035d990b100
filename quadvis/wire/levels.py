"""The five levels of a key, as in xPC Target's web interface: each may less than the one before."""

from __future__ import annotations

LEVELS = (
    "may do all",
    "may start and stop, and tunes nothing",
    "may see parameters and add scopes, and starts nothing",
    "may look, not change",
    "may see the status alone",
)


def may(level: int) -> str:
    """Return what a level may do: "may look, not change (level 3)"."""
    return f"{LEVELS[level]} (level {level})"
