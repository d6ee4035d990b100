"""A diagram as a book: the whole on the first page, then each part on a page of its own, as PDF."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.picture import picture_of
from quadvis.output.draw import draw
from quadvis.output.folding import DrawnPicture, folded, part_alone, parts_of, shortened
from quadvis.output.sheets import PAPERS, Leaf, bound

MOST_UNFOLDED = 30  # blocks: more of them with the frames of parts fit on no page
ASPECTS = (1.0, 1.4)  # of drawings whose columns are wrapped that are tried
ROWS = (1400.0, 1750.0)  # widths (pixels) of drawings in rows that are tried


def draw_book(diagram: Diagram, paper: str = "") -> bytes:
    """Return the pictures of a diagram and of its parts as a PDF, with links between the pages.

    ``paper`` is "a3" or "a4"; if it is left out, the smaller one on which all of it is legible. What is too
    large is drawn with its parts as one box each, a click on which leads to their page.
    """
    picture, tasks = picture_of(diagram)
    papers = [paper] if paper else [*PAPERS]
    sheets = [_sheet(diagram.name, "", picture, tasks, papers)]
    sheets += [
        _sheet(diagram.name, part, part_alone(picture, part), tasks, papers)
        for part in parts_of(picture.blocks)
    ]
    return bound(diagram.name, sheets, paper)


def _sheet(name: str, part: str, picture: DrawnPicture, tasks: Mapping[str, str], papers: list[str]) -> Leaf:
    """Return the picture that shows most and is still legible on one page; else the most compact one."""
    front = f"{part}/" if part else ""
    links = {path: front + path for path in parts_of(picture.blocks)}
    outer, level = part.rpartition("/")[0], 0 if not part else 1 + part.count("/")
    title = f"{name}: {part}" if part else name
    found: list[Leaf] = []
    for each, how in _ways(picture):
        drawn = draw(title, each.blocks, each.wires, each.constants, tasks, **how)
        found.append(Leaf(part or name, drawn, links, (outer or name) if part else "", level))
        if found[-1].fits(papers[-1]):
            return found[-1]
    compact = [leaf for leaf, (each, _) in zip(found, _ways(picture), strict=True) if _is_flat(each)]
    return max(compact or found, key=lambda leaf: leaf.scale(papers[-1]))


def _ways(picture: DrawnPicture) -> Iterator[tuple[DrawnPicture, dict[str, Any]]]:
    """Yield pictures and how to lay each out, the one that shows most first."""
    shallow = folded(picture, 1)
    if picture.blocks == shallow.blocks or len(picture.blocks) <= MOST_UNFOLDED:
        yield picture, {}
        if not _is_flat(picture):
            yield from ((picture, {"row": row}) for row in ROWS)
            yield shallow, {}
    else:
        yield shallow, {}
    for each in (shallow, shortened(shallow)):
        yield from ((each, {"aspect": aspect}) for aspect in ASPECTS)
    yield from ((shallow, {"row": row}) for row in ROWS)


def _is_flat(picture: DrawnPicture) -> bool:
    """Return whether no frame of a part is in a picture."""
    return not parts_of(picture.blocks)
