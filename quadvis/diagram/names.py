"""Match given names to wanted names: find the name that a misspelt one means."""

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


def remedy_for(name: str, given: Collection[str], known: Collection[str], *, replaces: bool = False) -> str:
    """Return the name that an unknown one means: a free name, or one that was written twice.

    A setting from outside ``replaces`` a given value: for it every name is free.
    """
    if not known:
        return "it has none"
    free = list(known) if replaces else [other for other in known if other not in given]
    near = closest(name, free)
    taken = closest(name, [other for other in known if other not in free])
    if near is None and taken is not None:
        return f"did you mean '{taken}', which is given already?"
    return suggestion(name, free or known)
