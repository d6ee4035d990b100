"""The site as a whole: all pages are written into a folder of pages, then rendered and checked."""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from documentation.block_pages import block_page, contents, group_page
from documentation.block_pictures import draw_block, pictures
from documentation.diagram_pages import diagram_files, diagram_page, diagram_picture, users_of
from documentation.error_index import error_page
from documentation.generator import render
from documentation.link_check import broken_links
from documentation.markdown import from_docstring
from documentation.site_map import GUIDES, LIBRARY, ROOT, page_of, relinked
from documentation.staging import Staging
from documentation.words import words
from quadvis.block import Block
from quadvis.library.catalogue import Catalogue

READMES = (
    "README.md",
    "quadvis/README.md",
    "blocks/README.md",
    "diagrams/README.md",
    "tests/faults/README.md",
)
ORPHAN = "---\norphan: true\n---\n\n"  # for Sphinx: a page that no table of contents has
GUIDE_PAGES = {
    "Begin": ["first_flight", "concepts", "coming_from"],
    "How to": [
        "own_block", "own_craft", "own_camera", "own_protocol", "tuning", "sweeps", "real_time", "fmu",
    ],
}  # fmt: skip
CONTENTS = {
    **{caption: [f"guides/{name}" for name in names] for caption, names in GUIDE_PAGES.items()},
    "Look up": ["diagrams/index", "blocks/index", "errors", "quadvis/index", "tests/faults/index"],
}


def build_site(
    output: Path,
    cache: Path,
    *,
    names: Collection[str] | None = None,
    drawn: Collection[str] | None = None,
    say: Callable[[str], object] = lambda line: None,
) -> list[str]:
    """Build the site, with the blocks of these names or all; return what is wrong with its links.

    ``drawn`` are the blocks and the diagrams (by their paths from the root) that get pictures; all if None.
    ``cache`` keeps pages, pictures and what Sphinx has read, for the next build. QuadvisError if a page is
    wrong.
    """
    staging = Staging(cache / "pages")
    blocks = _blocks(names)
    files = diagram_files() if names is None else []
    if names is None and drawn is None:
        _draw_together(blocks, files, cache / "pictures")
    for name in _write_blocks(staging, blocks, files, cache / "pictures", drawn):
        say(f"page of {name}")
    _write_diagrams(staging, files, set(blocks), cache / "pictures", drawn)
    if names is None:
        staging.write("errors.md", error_page())
        _write_documents(staging, set(blocks))
    else:
        staging.write("index.md", "# Blocks\n" + _groups(blocks))
    staging.clear()
    say("rendering")
    render(staging.folder, output, cache / "sphinx")
    return broken_links(output)


def _blocks(names: Collection[str] | None) -> dict[str, type[Block]]:
    catalogue = Catalogue()
    return {name: catalogue.find(name) for name in (catalogue.names() if names is None else names)}


def _draw_together(names: Iterable[str], files: Iterable[str], cache: Path) -> None:
    """Put all pictures into the cache, as many at once as there are processors; diagrams take longest."""
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        drawn: list[Future[Any]] = [
            pool.submit(diagram_picture, file, cache) for file in files if _is_diagram(file)
        ]
        drawn += [pool.submit(draw_block, name, cache) for name in names]
        for each in drawn:
            each.result()


def _is_diagram(file: str) -> bool:
    """Return whether a file is one that can be drawn; a part alone is no diagram."""
    return file.count("/") == 1


def _write_blocks(
    staging: Staging,
    blocks: dict[str, type[Block]],
    files: Collection[str],
    cache: Path,
    drawn: Collection[str] | None,
) -> Iterator[str]:
    """Write the pages of blocks and of their groups; yield each name when its page is written."""
    groups: dict[str, dict[str, type[Block]]] = {}
    for name, block in blocks.items():
        group, _, short = name.partition(".")
        groups.setdefault(group, {})[name] = block
        made = pictures(name, block, cache) if drawn is None or name in drawn else {}
        for file, content in made.items():
            staging.write(f"blocks/{group}/{short}-{file}", content)
        used = {file: os.path.relpath(page_of(file), f"blocks/{group}") for file in users_of(name, files)}
        staging.write(f"blocks/{group}/{short}.md", block_page(name, block, list(made), used))
        yield name
    for group, members in groups.items():
        text = inspect.getdoc(importlib.import_module(f"{Path(LIBRARY).name}.{group}")) or ""
        staging.write(f"blocks/{group}/index.md", group_page(group, from_docstring(text), members))


def _write_diagrams(
    staging: Staging, files: Iterable[str], blocks: set[str], cache: Path, drawn: Collection[str] | None
) -> None:
    for file in files:
        page = page_of(file)
        is_drawn = _is_diagram(file) and (drawn is None or file in drawn)
        picture = diagram_picture(file, cache) if is_drawn else ""
        if picture:
            staging.write(page.replace(".md", ".svg"), picture)
        shown = Path(page).with_suffix(".svg").name if picture else ""
        staging.write(page, diagram_page(file, shown, blocks))


def _write_documents(staging: Staging, blocks: set[str]) -> None:
    """Write the READMEs, and all files to which they lead, one after the other."""
    documents = [*READMES, *(f"{GUIDES}/{name}.md" for pages in GUIDE_PAGES.values() for name in pages)]
    waiting, seen = list(documents), set(documents)
    while waiting:
        path = waiting.pop()
        page = page_of(path)
        if page.endswith(".md") and not path.endswith(".md"):
            continue  # a diagram, which has its page
        if not page.endswith(".md"):
            staging.write(page, (ROOT / path).read_bytes())
            continue
        text, leads_to = relinked((ROOT / path).read_text(encoding="utf-8"), path)
        if path == f"{GUIDES}/coming_from.md":
            text += words(blocks)
        head = "" if path in documents else ORPHAN
        staging.write(page, head + text + _contents(page, blocks))
        waiting += sorted(leads_to - seen)
        seen |= leads_to


def _contents(page: str, blocks: set[str]) -> str:
    """Return the tables of contents of a page, which the margin of every page shows."""
    if page == "index.md":
        return "".join(contents(pages, caption) for caption, pages in CONTENTS.items())
    if page == "blocks/index.md":
        return _groups(blocks, "")
    if page == "diagrams/index.md":
        pages = (os.path.relpath(page_of(file), "diagrams").removesuffix(".md") for file in diagram_files())
        return contents(list(pages))
    return ""


def _groups(blocks: Iterable[str], folder: str = "blocks/") -> str:
    """Return the table of contents of the groups of blocks."""
    return contents(
        [f"{folder}{group}/index" for group in sorted({name.partition(".")[0] for name in blocks})]
    )
