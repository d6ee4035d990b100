"""Drawings on sheets of paper: each as large as a sheet allows, or on several if it were too small."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from quadvis.output.pdf import Page, Typeface, number, pdf
from quadvis.output.svg_pdf import BOLD, PLAIN, SVG, operators, shift, texts, typeset

PAPERS = {"a4": (841.89, 595.28), "a3": (1190.55, 841.89)}  # points, the long side across
EDGE, FOOT, FOOT_TYPE = 14.0, 16.0, 8.0  # points: free at each side; the line at the bottom and its type
FOOT_INK = "#4d4d4d"
LEAST = 6.0  # points: the smallest type that is legible
LARGEST = 0.75  # points for a pixel: the size that a drawing has by itself
SHARED = 80.0  # pixels that two sheets of one drawing have in common

_FILES = {PLAIN: "DejaVuSans.ttf", BOLD: "DejaVuSans-Bold.ttf"}
Area = tuple[float, float, float, float]  # left, top, right, bottom in pixels


@dataclass
class Leaf:
    """A drawing for a page of its own. ``links`` are the titles of the sheets to which boxes lead, by path.

    ``up`` is the title of the sheet to which its own title leads.
    """

    title: str
    drawing: str
    links: Mapping[str, str] = field(default_factory=dict)
    up: str = ""
    level: int = 0

    def __post_init__(self) -> None:
        self.root = ElementTree.fromstring(self.drawing)
        self.width, self.height = (float(self.root.get(side, "0")) for side in ("width", "height"))
        sizes = [float(text.get("font-size", "0")) for text in self.root.iter(f"{SVG}text")]
        self.least_scale = LEAST / min(sizes)

    def scale(self, paper: str) -> float:
        """Return the points for a pixel at which the whole drawing fits on a paper."""
        across, along = _room(paper)
        return min(across / self.width, along / self.height, LARGEST)

    def fits(self, paper: str) -> bool:
        """Say whether the drawing is legible on one page."""
        return self.scale(paper) >= self.least_scale

    def areas(self) -> Iterator[tuple[Area, str]]:
        """Yield the places that lead to other sheets, and the titles of these."""
        for group, (left, top) in _groups(self.root, 0.0, 0.0):
            title = self.links.get(group.get("data-path", ""))
            shape = group.find(f"{SVG}rect")
            if title is None or shape is None:
                continue
            x, y, width, height = (float(shape.get(name, "0")) for name in ("x", "y", "width", "height"))
            height = 28.0 if group.get("class") == "part" else height  # of a frame, its title
            yield (left + x, top + y, left + x + width, top + y + height), title
        if self.up:
            yield (0.0, 0.0, self.width, 45.0), self.up


def bound(title: str, sheets: Sequence[Leaf], paper: str = "") -> bytes:
    """Return sheets as a PDF, with links between them and page numbers.

    ``paper`` is a3 or a4; if it is left out, the smaller one on which all are legible. A drawing that would
    be too small on one page goes on over several.
    """
    paper = paper or next((name for name in PAPERS if all(sheet.fits(name) for sheet in sheets)), "a3")
    tiles = [(sheet, tile, count) for sheet in sheets for tile, count in _tiles(sheet, paper)]
    first = {sheet.title: place for place, (sheet, _, _) in reversed(list(enumerate(tiles)))}
    feet = [_foot(title, sheet, tile, count) for sheet, tile, count in tiles]
    faces = _faces(sheets, feet, len(tiles))
    pages = []
    for place, ((sheet, tile, _), foot) in enumerate(zip(tiles, feet, strict=True)):
        page = _page(sheet, tile, paper, faces, first)
        page.operators += _footer(page, foot, f"{place + 1} / {len(tiles)}", faces)
        pages.append(page)
    return pdf(title, pages, faces)


@dataclass
class _Tile:
    """The part of a drawing that is on one page, and its scale."""

    number: int
    area: Area
    scale: float


def _room(paper: str) -> tuple[float, float]:
    width, height = PAPERS[paper]
    return width - 2 * EDGE, height - 2 * EDGE - FOOT


def _tiles(sheet: Leaf, paper: str) -> Iterator[tuple[_Tile, int]]:
    """Yield the tiles of a drawing, row by row, with their number."""
    if sheet.fits(paper):
        yield _Tile(1, (0.0, 0.0, sheet.width, sheet.height), sheet.scale(paper)), 1
        return
    scale = sheet.least_scale
    across, along = (length / scale for length in _room(paper))
    columns = max(1, math.ceil((sheet.width - SHARED) / (across - SHARED)))
    rows = max(1, math.ceil((sheet.height - SHARED) / (along - SHARED)))
    for place in range(rows * columns):
        left, top = (place % columns) * (across - SHARED), (place // columns) * (along - SHARED)
        area = left, top, min(left + across, sheet.width), min(top + along, sheet.height)
        yield _Tile(place + 1, area, scale), rows * columns


def _page(
    sheet: Leaf, tile: _Tile, paper: str, faces: Mapping[str, Typeface], first: Mapping[str, int]
) -> Page:
    width, height = PAPERS[paper]
    (left, top, right, bottom), scale = tile.area, tile.scale
    # In the middle of the page; tiles begin at its upper left corner.
    x = EDGE if tile.area[2] - left < sheet.width else (width - scale * sheet.width) / 2
    y = height - EDGE
    page = Page(sheet.title, width, height, level=sheet.level)
    matrix = " ".join(map(number, (x - scale * left, y + scale * top)))
    page.operators += [
        f"q {scale:.5f} 0 0 {-scale:.5f} {matrix} cm",
        f"{number(left)} {number(top)} {number(right - left)} {number(bottom - top)} re W n",
        *operators(sheet.root, faces),
        "Q",
    ]
    for (x0, y0, x1, y1), title in sheet.areas():
        x0, y0, x1, y1 = max(x0, left), max(y0, top), min(x1, right), min(y1, bottom)
        if x0 < x1 and y0 < y1:
            place = (
                x + scale * (x0 - left),
                y - scale * (y1 - top),
                x + scale * (x1 - left),
                y - scale * (y0 - top),
            )
            page.links.append((place, first[title]))
    return page


def _foot(title: str, sheet: Leaf, tile: _Tile, count: int) -> str:
    """Return what stands at the foot of a page."""
    text = title if sheet.title == title else f"{title}: {sheet.title}"
    return f"{text}, sheet {tile.number} of {count}" if count > 1 else text


def _footer(page: Page, text: str, place: str, faces: Mapping[str, Typeface]) -> Iterator[str]:
    face = faces[PLAIN]
    right = page.width - EDGE - face.width(place, FOOT_TYPE)
    for x, words in ((EDGE, text), (right, place)):
        begin = f"{number(x)} {number(EDGE)} Td"
        yield typeset(words, PLAIN, FOOT_TYPE, begin, FOOT_INK, faces)


def _faces(sheets: Sequence[Leaf], feet: Sequence[str], count: int) -> dict[str, Typeface]:
    """Return the typefaces with all characters that the pages have."""
    import matplotlib

    used = {PLAIN: {"/", " ", *"0123456789", *"".join(feet)}, BOLD: {" "}}
    for sheet in sheets:
        for name, text in texts(sheet.root):
            used[name] |= set(text)
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    return {
        name: Typeface(f"DejaVu{name}", folder / _FILES[name], "".join(sorted(letters)))
        for name, letters in used.items()
    }


def _groups(
    element: ElementTree.Element, left: float, top: float
) -> Iterator[tuple[ElementTree.Element, tuple[float, float]]]:
    """Yield all groups with the place from which they count."""
    for group in element.findall(f"{SVG}g"):
        x, y = (
            place + float(moved) for place, moved in zip((left, top), shift(group) or ("0", "0"), strict=True)
        )
        yield group, (x, y)
        yield from _groups(group, x, y)
