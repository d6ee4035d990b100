"""Which file of the repository becomes which page of the site, and links that lead there.

A README keeps its place, so that its links mean the same here and in the repository. A link to a file that
is no page leads to a copy of it.
"""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = "blocks/quadvis_blocks"
GUIDES = "diagrams/guides"
_LINK = re.compile(r"(\]\()([^)\s#]*)(#[^)\s]*)?(\))")
_FENCE = re.compile(r"^\s*```")


def page_of(path: str) -> str:
    """Return where a file or folder of the repository stands in the site, by its path from the root."""
    if (ROOT / path).is_dir():
        return _folder_page(path)
    place = PurePosixPath(path)
    if place.name == "README.md":
        return str(place.with_name("index.md"))
    if place.is_relative_to(GUIDES):
        return str(PurePosixPath("guides") / place.relative_to(GUIDES))
    if has_blocks(path):
        return str(place.with_suffix(".md"))
    return path


def has_blocks(path: str) -> bool:
    """Return whether a file is a diagram or a part that comes with quadvis; each has a page."""
    place = PurePosixPath(path)
    return place.suffix == ".yaml" and str(place.parent) in {"diagrams", "diagrams/parts"}


def _folder_page(path: str) -> str:
    place = PurePosixPath(path)
    if place.is_relative_to(LIBRARY) and path != LIBRARY:
        return str("blocks" / place.relative_to(LIBRARY) / "index.md")
    while not (ROOT / place / "README.md").is_file():
        place = place.parent  # the root has one
    return page_of(str(place / "README.md"))


def relinked(text: str, path: str) -> tuple[str, set[str]]:
    """Return the Markdown of a file with links for the site, and the files to which they lead."""
    found: set[str] = set()
    here = os.path.dirname(page_of(path)) or "."

    def moved(match: re.Match[str]) -> str:
        target = match[2]
        if not target or "://" in target or target.startswith("mailto:"):
            return match[0]
        file = os.path.normpath(os.path.join(os.path.dirname(path), target))
        if not (ROOT / file).exists():
            return match[0]  # the check of links reports it
        if (ROOT / file).is_file():
            found.add(file)
        return f"{match[1]}{os.path.relpath(page_of(file), here)}{match[3] or ''}{match[4]}"

    lines, in_code = [], False
    for line in text.splitlines():
        fence = _FENCE.match(line) is not None
        lines.append(line if in_code or fence else _LINK.sub(moved, line))
        in_code ^= fence
    return "\n".join(lines) + "\n", found
