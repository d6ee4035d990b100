"""Names that were given and names that were wanted: what a misspelt one was meant to be."""

from __future__ import annotations

from collections.abc import Collection

from quadvis.errors import closest, suggestion


def absent(wanted: Collection[str], given: Collection[str], known: Collection[str]) -> list[str]:
    """Return the wanted names that are missing, but not those that a misspelt one was meant to be."""
    missing = [name for name in wanted if name not in given]
    strange = [name for name in given if name not in known]
    if len(missing) == len(strange) == 1:
        return []
    meant = {closest(name, missing) for name in strange}
    return [name for name in missing if name not in meant]


def remedy_for(name: str, given: Collection[str], known: Collection[str]) -> str:
    """Return what was meant by an unknown name, out of those that are still free."""
    free = [other for other in known if other not in given]
    return suggestion(name, free or known) if known else "it has none"
