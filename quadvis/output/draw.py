"""Draw a block diagram as SVG: boxes with named ports, orthogonal wires, colours by rate.

The Eclipse Layout Kernel's layered algorithm places the boxes and routes the wires; it is made for diagrams
with ports (see `quadvis/output/elkjs`). Large diagrams are placed by `quadvis.output.layers`. This module
states the sizes, and draws the placed shapes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from quadvis.output import elkjs as engine
from quadvis.output import layers, svg
from quadvis.output.drawing import PILL_COLOURS, Drawing
from quadvis.output.drawn import (
    ARROW,
    FAULT,
    INDENT,
    LINE,
    MARGIN,
    PORT,
    SMALL,
    TITLE,
    DrawnBlock,
    DrawnWire,
    Mark,
    last,
)  # fmt: skip
from quadvis.output.elkjs import LayoutError

__all__ = ["DrawnBlock", "DrawnWire", "draw"]

NOTES, NOTE = 900.0, 15.0  # least width of a picture with notes; from line to line of them
MOST_BLOCKS, MOST_WIRES = 250, 750
"""The engine takes half a minute for so many."""


def draw(
    title: str,
    blocks: Sequence[DrawnBlock],
    wires: Sequence[DrawnWire],
    constants: Mapping[tuple[str, str], str],
    tasks: Mapping[str, str],
    notes: Sequence[str] = (),
    *,
    row: float | None = None,
    aspect: float | None = None,
) -> str:
    """Return the diagram as the text of an SVG file; equal arguments give equal text.

    The blocks come in reading order: a loop without a source outside starts at its first block. `constants`
    are the values set at inputs, by (block, port). `tasks` are the words of the legend by task name,
    `CONTINUOUS` among them. `notes` are the sentences of faults, which stand below the diagram. With
    ``row`` the picture is laid out in rows of about this width (pixels), like the lines of a text; with
    ``aspect`` the engine does so, for about this width divided by height. Raises `QuadvisError` if the
    arguments contradict each other or the layout engine is missing; a diagram that the engine cannot place
    gets a simpler layout.
    """
    drawing = Drawing(blocks, wires, constants, tasks)
    placed = {shape["id"]: shape for shape in _shapes(_laid_out(drawing, row, aspect))}
    return _page(title, drawing, placed, notes)


def _laid_out(drawing: Drawing, row: float | None, aspect: float | None) -> dict[str, Any]:
    """Return the graph with positions: the layout engine's, or those of a simpler layout if it is large."""
    graph = drawing.graph(aspect)
    if row is None and len(drawing.blocks) <= MOST_BLOCKS and len(drawing.wires) <= MOST_WIRES:
        with suppress(LayoutError):
            return engine.layout(graph)
    return layers.layout(graph) if row is None else layers.layout(graph, row)


def _shapes(node: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield node
    yield from node.get("ports", ())
    yield from node.get("edges", ())
    for child in node.get("children", ()):
        yield from _shapes(child)


def _page(
    title: str, drawing: Drawing, placed: Mapping[str, dict[str, Any]], notes: Sequence[str] = ()
) -> str:
    """Return title, legend, diagram and notes: parts undermost, then wires, then boxes."""
    legend, legend_width = _legend(drawing)
    root, top = placed["root"], MARGIN + 2 * LINE
    width = 2 * MARGIN + max(root["width"], legend_width, svg.text_width(title, TITLE, bold=True))
    width = max(width, NOTES) if notes else width
    texts = [line for note in notes for line in _wrapped(note, width - 2 * MARGIN)]
    bottom = top + root["height"] + MARGIN
    height = bottom + (len(texts) * NOTE + MARGIN if texts else 0.0)
    lines = [
        svg.opening(
            "svg",
            xmlns="http://www.w3.org/2000/svg",
            width=width,
            height=height,
            viewBox=f"0 0 {width:.1f} {height:.1f}",
            font_family=svg.FONT,
            role="img",
        ),
        svg.element("title", title),
        svg.element("rect", width=width, height=height, fill="#ffffff"),
        svg.text(title, MARGIN, MARGIN + 12, TITLE, bold=True),
        svg.opening("g", transform=f"translate({MARGIN} {MARGIN + LINE})"),
        *legend,
        "</g>",
        svg.opening("g", transform=f"translate({MARGIN} {top})"),
    ]
    for shape in placed.values():
        if shape["id"].startswith("p"):
            lines += _part(shape)
    for number in range(len(drawing.wires)):
        lines += _wire(drawing, number, placed[f"w{number}"])
    for number in range(len(drawing.blocks)):
        lines += _block(drawing, number, placed[f"b{number}"])
    lines.append("</g>")
    for number, text in enumerate(texts, 1):
        lines.append(svg.text(text, MARGIN, bottom + number * NOTE, PORT, fill=FAULT))
    return "\n".join([*lines, "</svg>", ""])


def _wrapped(note: str, room: float) -> list[str]:
    """Return a sentence in lines of which none is wider than the room."""
    lines = [""]
    for word in note.split(" "):
        longer = f"{lines[-1]} {word}" if lines[-1] else word
        if lines[-1] and svg.text_width(longer, PORT) > room:
            lines.append(f"  {word}")
        else:
            lines[-1] = longer
    return lines


def _legend(drawing: Drawing) -> tuple[list[str], float]:
    """Return the elements of the legend, all on one line, and its length."""
    entries = [(label, drawing.colours[task], 2) for task, label in drawing.tasks.items()]
    if any(mark.crossing for mark in drawing.marks.values()):
        entries.append(("how a wire crosses rates", PILL_COLOURS, 6))
    if any(block.faulty for block in drawing.blocks):
        entries.append(("a fault: see below", ("#ffffff", FAULT), 2))
    lines, x = [], 0.0
    for label, (fill, line), radius in entries:
        lines.append(svg.element("rect", x=x, y=0, width=20, height=12, rx=radius, fill=fill, stroke=line))
        lines.append(svg.text(label, x + 26, 10, PORT))
        x += 26 + svg.text_width(label, PORT) + 20
    return lines, x


def _part(shape: Mapping[str, Any]) -> Iterator[str]:
    path, x, y = shape["id"][1:], shape["x"], shape["y"]
    size = {"x": x, "y": y, "width": shape["width"], "height": shape["height"]}
    yield svg.opening("g", class_="part", data_path=path)
    yield svg.element("rect", **size, rx=6, fill="#f6f7f8", stroke="#8a8f98", stroke_dasharray="5 3")
    yield svg.text(last(path), x + 2 * INDENT, y + 19, PORT, bold=True, fill="#4a4f57")
    yield "</g>"


def _wire(drawing: Drawing, number: int, shape: Mapping[str, Any]) -> Iterator[str]:
    wire, (source, target) = drawing.wires[number], drawing.ends[number]
    colour = FAULT if wire.fault else drawing.colours_of(int(source[1:].partition(".")[0])).line
    (section,) = shape["sections"]
    corners = [section["startPoint"], *section.get("bendPoints", ()), section["endPoint"]]
    x, y = corners[-1]["x"] + drawing.reach(target) + drawing.inset(target), corners[-1]["y"]
    way = [(corner["x"], corner["y"]) for corner in corners]
    start = (way[0][0] - drawing.inset(source), way[0][1])
    line = svg.points([start, *way[1:], (x, y)])
    end = f"{wire.target_block}.{wire.target_port}"
    yield svg.opening("g", class_="wire", data_source=wire.source, data_target=end)
    words = f"{wire.source} → {end}" + (f" ({wire.crossing})" if wire.crossing else "")
    yield svg.element("title", f"{words}: {wire.fault}" if wire.fault else words)
    yield svg.element("polyline", points=line, fill="none", stroke=colour, stroke_width=1.3)
    yield svg.element("polygon", points=svg.points([(x, y), (x - 7, y - 3), (x - 7, y + 3)]), fill=colour)
    for junction in shape.get("junctionPoints", ()):
        yield svg.element("circle", cx=junction["x"], cy=junction["y"], r=2.6, fill=colour)
    yield "</g>"


def _block(drawing: Drawing, number: int, shape: Mapping[str, Any]) -> Iterator[str]:
    block, form, x, y = drawing.blocks[number], drawing.forms[number], shape["x"], shape["y"]
    yield svg.opening("g", class_="block", data_path=block.path)
    whole, colours = block.faulty.get("", ""), drawing.colours_of(number)
    yield svg.element("title", f"{block.path}: {block.kind}" + (f": {whole}" if whole else ""))
    yield from form.elements(x, y, replace(colours, line=FAULT, width=3.0) if whole else colours)
    for row, (inset, height) in enumerate(form.inputs):
        if mark := drawing.marks.get(f"b{number}.i{row}"):
            yield from _mark(mark, x, y + height, inset)
        if words := block.faulty.get(block.inputs[row]):
            yield from _spot(x + inset, y + height, words)
    yield "</g>"


def _spot(x: float, y: float, words: str) -> Iterator[str]:
    """Yield the mark of a faulty input."""
    yield svg.opening("g", class_="fault")
    yield svg.element("title", words)
    yield svg.element("circle", cx=x, cy=y, r=5, fill=FAULT, stroke="#ffffff", stroke_width=1)
    yield "</g>"


def _mark(mark: Mark, x: float, y: float, inset: float) -> Iterable[str]:
    """Yield the mark before the room of a block at (x, y); its outline begins ``inset`` further on."""
    left = x - ARROW - mark.width
    size = {"x": left, "y": y - 7, "width": mark.width, "height": 14}
    fill, line = PILL_COLOURS if mark.crossing else ("#ffffff", "none")
    yield svg.opening("g", class_="mark")
    yield svg.element("title", mark.text)
    if mark.constant:
        yield svg.text(mark.shown, x - ARROW - 3, y + 3.5, SMALL, anchor="end", fill="#333333")
        yield svg.element("polyline", points=svg.points([(x - ARROW, y), (x + inset, y)]), stroke="#555555")
    else:
        yield svg.element("rect", **size, rx=7, fill=fill, stroke=line)
        yield svg.text(mark.shown, left + mark.width / 2, y + 3.5, SMALL, anchor="middle", fill="#333333")
    yield "</g>"
