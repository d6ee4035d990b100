"""The files of the page, read once: a request names one of them and nothing else on the disk."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).parent / "page"
KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}


class PageFile(NamedTuple):
    """One file: its bytes and its content type."""

    data: bytes
    kind: str


def page_files() -> Mapping[str, PageFile]:
    """Return the files of the page by the path of a request."""
    found = {
        f"/{path.relative_to(FOLDER).as_posix()}": PageFile(path.read_bytes(), KINDS[path.suffix])
        for path in sorted(FOLDER.rglob("*"))
        if path.suffix in KINDS
    }
    return {"/": found["/index.html"], **found}
