"""The libraries of blocks that distributions have registered, read from their files of entry points.

`importlib.metadata` finds the same, and is asked where modules are in archives; it brings the modules of
e-mail, whose import takes a quarter of the time of `quadvis list`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator

GROUP = "quadvis.libraries"  # of entry points
_INFO = (".dist-info", ".egg-info")


def registered_libraries() -> dict[str, str]:
    """Return the packages of all libraries of blocks, by the names under which they are registered."""
    if any(map(os.path.isfile, sys.path)):
        from importlib.metadata import entry_points

        return {entry.name: entry.module for entry in entry_points(group=GROUP)}
    return {name: value for text in _entry_point_texts() for name, value in _entries(text)}


def _entry_point_texts() -> Iterator[str]:
    """Yield the entry points of each distribution, as a text; the first one of a name hides later ones."""
    seen: set[str] = set()
    for folder in sys.path:
        try:
            infos = sorted(name for name in os.listdir(folder or ".") if name.endswith(_INFO))
        except OSError:  # such as the archive of the standard library, which is not there
            continue
        for info in infos:
            distribution = info.rpartition(".")[0].partition("-")[0].casefold().replace("-", "_")
            if distribution in seen:
                continue
            seen.add(distribution)
            try:
                with open(os.path.join(folder, info, "entry_points.txt"), encoding="utf-8") as file:
                    yield file.read()
            except OSError:  # most have none
                continue


def _entries(text: str) -> Iterator[tuple[str, str]]:
    """Yield the names and packages that a file of entry points registers as libraries."""
    section = ""
    for line in map(str.strip, text.splitlines()):
        if line.startswith("["):
            section = line.strip("[]").strip()
        elif section == GROUP and "=" in line and not line.startswith(("#", ";")):
            name, _, value = line.partition("=")
            yield name.strip(), value.partition("[")[0].strip()
