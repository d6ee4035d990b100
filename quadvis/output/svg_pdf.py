"""Our own drawings, from SVG to the operators of a PDF page: only the elements that they have."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from xml.etree import ElementTree

from quadvis.output.pdf import Typeface, colour, number

SVG = "{http://www.w3.org/2000/svg}"
_BEND = 0.5523  # of a circle that is made of four curves
_MOVE = re.compile(r"translate\(([-\d.]+) ([-\d.]+)\)")
PLAIN, BOLD = "F", "B"  # the names of the typefaces


def operators(root: ElementTree.Element, faces: Mapping[str, Typeface]) -> Iterator[str]:
    """Yield the operators that draw an SVG file, in its own coordinates: y goes down."""
    for element in root:
        tag = element.tag.removeprefix(SVG)
        if tag == "g":
            found = shift(element)
            yield f"q 1 0 0 1 {found[0]} {found[1]} cm" if found else "q"
            yield from operators(element, faces)
            yield "Q"
        elif tag == "text":
            yield _text(element, faces)
        elif tag in _PATHS:
            yield from _shape(element, _PATHS[tag](element))


def shift(group: ElementTree.Element) -> tuple[str, str] | None:
    """Return how far a group is moved, to the right and down; None if it is not."""
    found = _MOVE.fullmatch(group.get("transform", ""))
    return None if found is None else (found[1], found[2])


def texts(root: ElementTree.Element) -> Iterator[tuple[str, str]]:
    """Yield the name of a typeface and each text that is set in it."""
    for element in root.iter(f"{SVG}text"):
        yield _face(element), element.text or ""


def _face(element: ElementTree.Element) -> str:
    return BOLD if element.get("font-weight") == "bold" else PLAIN


def _value(element: ElementTree.Element, name: str) -> float:
    return float(element.get(name, "0"))


def _text(element: ElementTree.Element, faces: Mapping[str, Typeface]) -> str:
    name, text, size = _face(element), element.text or "", _value(element, "font-size")
    width = faces[name].width(text, size)
    x = _value(element, "x") - {"middle": width / 2, "end": width}.get(element.get("text-anchor", ""), 0.0)
    place = f"1 0 0 -1 {number(x)} {number(_value(element, 'y'))} Tm"
    return typeset(text, name, size, place, element.get("fill", "#000000"), faces)


def typeset(text: str, name: str, size: float, place: str, fill: str, faces: Mapping[str, Typeface]) -> str:
    """Return the operators that set a text in a typeface; ``place`` are those that move to its begin."""
    face = faces[name]
    return f"BT {colour(fill)} rg /{name} {number(size)} Tf {place} <{face.hexadecimal(text)}> Tj ET"


def _shape(element: ElementTree.Element, path: str) -> Iterator[str]:
    """Yield a path with its fill and line."""
    fill, line = (element.get(name, none) for name, none in (("fill", "#000000"), ("stroke", "none")))
    dashes = element.get("stroke-dasharray", "")
    yield f"q {number(float(element.get('stroke-width', '1')))} w 1 j [{dashes}] 0 d"
    if fill != "none":
        yield f"{colour(fill)} rg"
    if line != "none":
        yield f"{colour(line)} RG"
    paint = {(True, True): "B", (True, False): "f", (False, True): "S", (False, False): "n"}
    yield f"{path} {paint[fill != 'none', line != 'none']} Q"


def _corners(element: ElementTree.Element) -> str:
    first, *others = (corner.split(",") for corner in element.get("points", "").split())
    return " ".join((f"{first[0]} {first[1]} m", *(f"{x} {y} l" for x, y in others)))


def _rectangle(element: ElementTree.Element) -> str:
    x, y, width, height = (_value(element, name) for name in ("x", "y", "width", "height"))
    r = min(_value(element, "rx"), width / 2, height / 2)
    if not r:
        return f"{number(x)} {number(y)} {number(width)} {number(height)} re"
    return _round(x, y, x + width, y + height, r)


def _circle(element: ElementTree.Element) -> str:
    x, y, r = (_value(element, name) for name in ("cx", "cy", "r"))
    return _round(x - r, y - r, x + r, y + r, r)


def _round(left: float, top: float, right: float, bottom: float, r: float) -> str:
    """Return a rectangle with round corners."""
    b = r * (1 - _BEND)

    def line(x: float, y: float) -> str:
        return f"{number(x)} {number(y)} l"

    def curve(*places: float) -> str:
        return " ".join(map(number, places)) + " c"

    return " ".join((
        f"{number(left + r)} {number(top)} m", line(right - r, top),
        curve(right - b, top, right, top + b, right, top + r), line(right, bottom - r),
        curve(right, bottom - b, right - b, bottom, right - r, bottom), line(left + r, bottom),
        curve(left + b, bottom, left, bottom - b, left, bottom - r), line(left, top + r),
        curve(left, top + b, left + b, top, left + r, top), "h",
    ))  # fmt: skip


_PATHS: Mapping[str, Callable[[ElementTree.Element], str]] = {
    "rect": _rectangle,
    "circle": _circle,
    "polyline": _corners,
    "polygon": lambda element: f"{_corners(element)} h",
}
