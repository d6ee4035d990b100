"""A page for each diagram and each part that comes with quadvis: what it is, its picture, its text."""

from __future__ import annotations

import functools
import hashlib
import os
import re
from collections.abc import Collection
from pathlib import Path, PurePosixPath

from documentation.block_pictures import common
from documentation.markdown import escaped
from documentation.site_map import ROOT, page_of
from quadvis.api import load
from quadvis.errors import QuadvisError

_BLOCK = re.compile(r"\bblock: ([a-z][\w.]*)")


def diagram_files() -> list[str]:
    """Return the diagrams and parts that come with quadvis, by their paths from the root."""
    folder = ROOT / "diagrams"
    files = [*sorted(folder.glob("*.yaml")), *sorted(folder.glob("parts/*.yaml"))]
    return [file.relative_to(ROOT).as_posix() for file in files]


def users_of(name: str, files: Collection[str]) -> list[str]:
    """Return those of the files that name a block."""
    return [file for file in files if name in _named(file)]


@functools.cache
def _named(file: str) -> frozenset[str]:
    """Return the names of the blocks that stand in a file."""
    return frozenset(_BLOCK.findall((ROOT / file).read_text(encoding="utf-8")))


def diagram_page(file: str, picture: str, blocks: set[str]) -> str:
    """Return the page of a diagram; ``blocks`` are those that have a page."""
    text = (ROOT / file).read_text(encoding="utf-8")
    name, here = PurePosixPath(file).name, os.path.dirname(page_of(file))
    parts = [f"# {name}", escaped(_comment(text))]
    if picture:
        parts.append(f"![{name} as a diagram]({picture})")
    pages = {block: f"blocks/{block.replace('.', '/')}.md" for block in sorted(_named(file) & blocks)}
    links = [f"[{block}]({os.path.relpath(page, here)})" for block, page in pages.items()]
    if links:
        parts.append(f"Its blocks: {', '.join(links)}")
    parts.append(f"```yaml\n{text.rstrip()}\n```")
    return "\n\n".join(filter(None, parts)) + "\n"


def _comment(text: str) -> str:
    """Return the comment at the top of a file."""
    lines = re.match(r"(?:#.*\n)*", text)
    return "\n".join(line.removeprefix("#").strip() for line in (lines[0] if lines else "").splitlines())


def diagram_picture(file: str, cache: Path) -> str:
    """Return a diagram as SVG, "" if it cannot be made here, for example without an extra of quadvis."""
    kept = cache / f"{_key(file)}.svg"
    if not kept.is_file():
        try:
            drawn = load(ROOT / file).draw()
        except QuadvisError:
            return ""
        cache.mkdir(parents=True, exist_ok=True)
        kept.write_text(drawn, encoding="utf-8")
    return kept.read_text(encoding="utf-8")


def _key(file: str) -> str:
    texts = [path.read_bytes() for path in sorted((ROOT / "diagrams").rglob("*.yaml"))]
    return hashlib.sha256(b"\0".join([common(), file.encode(), *texts])).hexdigest()[:24]
