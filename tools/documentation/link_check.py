"""The links of a site: each leads to a file of it and, with ``#``, to a place in that file.

Links to other sites are not followed: what they answer depends on the day.
"""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_LINKS = {"a": "href", "link": "href", "img": "src", "script": "src", "object": "data", "source": "src"}


class _Page(HTMLParser):
    """The links and the places of one page."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.places: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if value is None:
                continue
            if name == "id" or (name == "name" and tag == "a"):
                self.places.add(value)
            elif _LINKS.get(tag) == name:
                self.links.append(value)


def broken_links(site: Path) -> list[str]:
    """Return a sentence for each link that leads nowhere."""
    pages = {path.resolve(): _read(path) for path in sorted(site.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        for link in dict.fromkeys(page.links):
            if problem := _problem(path, link, pages):
                found.append(f"{path.relative_to(site.resolve())}: the link {link!r} {problem}")
    return found


def _read(path: Path) -> _Page:
    page = _Page()
    page.feed(path.read_text(encoding="utf-8"))
    return page


def _problem(path: Path, link: str, pages: dict[Path, _Page]) -> str:
    """Return what is wrong with a link; "" if nothing is, or if it leads to another site."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return ""
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if target.is_dir():
        target /= "index.html"
    if not target.is_file():
        return "leads to no file"
    place = unquote(parts.fragment)
    if place and target in pages and place not in pages[target].places:
        return f"leads to no place in {target.name}"
    return ""
