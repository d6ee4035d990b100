"""Lay out large diagrams: boxes in columns, columns in bands like the lines of a text, wires between them.

The engine in `elkjs` gives better pictures, but takes minutes for some hundred boxes and fails for more. The
time of this one grows only in proportion to the diagram. Both read and return the same graphs.

A part is laid out by itself and then stands in its surroundings like a box: wires enter at its left side and
leave at its right side. `quadvis.output.bands` places and wires the boxes of one level.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

from quadvis.output.bands import EDGE, Sheet
from quadvis.output.boxes import ASPECT, GAP, LEAST_WIDTH, Box, Net, Point

TITLE = 30.0  # pixels that a part leaves free above its boxes

Shape = dict[str, Any]


def layout(graph: Shape, least: float = LEAST_WIDTH) -> Shape:
    """Return a graph in ELK's JSON format with positions filled in; equal graphs get equal positions.

    Rows that are narrower than ``least`` (pixels) are not folded.
    """
    root = _Level(graph, least=least)
    trails = dict(root.trails([]))
    for edge in graph["edges"]:
        _take(trails, edge["sources"][0], edge["targets"][0])
    root.measure()
    shapes = list(root.shapes(0.0, 0.0))
    edges = []
    for edge in graph["edges"]:
        start, *bends, end = _corners(trails, edge["sources"][0], edge["targets"][0])
        section = {"startPoint": start, "bendPoints": bends, "endPoint": end}
        edges.append({**edge, "sections": [section]})
    size = {"x": 0.0, "y": 0.0, "width": root.width, "height": root.height}
    return {"id": graph["id"], **size, "children": shapes, "edges": edges}


class _Level:
    """The inside of a part, or of the whole diagram, and the nets of wires on it."""

    def __init__(self, node: Shape, top: float = EDGE, least: float = LEAST_WIDTH) -> None:
        self.top, self.row = top, least
        self.least = _least_width(node)
        self.boxes: list[Box] = []
        self.inner: dict[str, _Level] = {}  # by the ids of the boxes that are parts
        self.nets: dict[str, Net] = {}
        self.width = self.height = self.x = self.y = 0.0
        for child in node.get("children", ()):
            ports = child.get("ports")
            if ports is None:
                self.inner[child["id"]] = _Level(child, TITLE, least)
                self.boxes.append(Box(child["id"]))
                continue
            box = Box(child["id"], child["width"], child["height"])
            box.ports = {port["id"]: port["y"] for port in ports}
            box.reach = {port["id"]: port["width"] for port in ports}
            self.boxes.append(box)

    def trails(self, outer: list[tuple[_Level, Box]]) -> Iterator[tuple[str, list[tuple[_Level, Box]]]]:
        """Yield each port with the levels around it, outermost first, and the box on each that holds it."""
        for box in self.boxes:
            trail = [*outer, (self, box)]
            if box.id in self.inner:
                yield from self.inner[box.id].trails(trail)
            else:
                yield from ((port, trail) for port in box.ports)

    def net(self, port: str, source: Box | None) -> Net:
        """Return the net of an output on this level; a net without a source enters the part."""
        return self.nets.setdefault(port, Net(port, source))

    def measure(self) -> None:
        """Place the boxes, first those inside parts, and find the size."""
        for box in self.boxes:
            if level := self.inner.get(box.id):
                level.measure()
                box.width, box.height = level.width, level.height
                box.ports = {net.port: net.height for net in level.nets.values() if net.is_terminal}
                box.reach = dict.fromkeys(box.ports, 0.0)
        sheets = [Sheet(boxes, nets, self.row) for boxes, nets in self._groups()]
        self.width, self.height = self._pack(sheets)
        for sheet in sheets:
            sheet.route(self.width)

    def _groups(self) -> Iterator[tuple[list[Box], list[Net]]]:
        """Yield groups of connected boxes with their nets; first the groups whose wires pass the frame."""
        parent = {box.id: box.id for box in self.boxes}

        def root(name: str) -> str:
            while parent[name] != name:
                parent[name] = parent[parent[name]]
                name = parent[name]
            return name

        frame: str | None = None
        for net in self.nets.values():
            names = [box.id for box in net.boxes]
            if net.is_terminal:
                names.append(frame := frame or names[0])
            for one, other in pairwise(names):
                parent[root(other)] = root(one)
        boxes: dict[str, list[Box]] = {root(frame): []} if frame else {}
        nets: dict[str, list[Net]] = {}
        for box in self.boxes:
            boxes.setdefault(root(box.id), []).append(box)
        for net in self.nets.values():
            nets.setdefault(root(net.boxes[0].id), []).append(net)
        for name, group in boxes.items():
            yield group, nets.get(name, [])

    def _pack(self, sheets: list[Sheet]) -> tuple[float, float]:
        """Put the sheets side by side on shelves; return the size of the whole."""
        area = sum(sheet.width * (sheet.height + GAP) for sheet in sheets)
        room = max([math.sqrt(area * ASPECT), *(sheet.width for sheet in sheets)])
        left, top, bottom, right = 0.0, self.top, self.top, self.least
        for sheet in sheets:
            if left and (left + sheet.width > room or (sheets[0].is_open and top == self.top)):
                left, top = 0.0, bottom + GAP
            sheet.x, sheet.y = left, top
            left += sheet.width
            right, bottom = max(right, left), max(bottom, top + sheet.height)
        return right, bottom + EDGE

    def shapes(self, x: float, y: float) -> Iterator[Shape]:
        """Yield all boxes in the coordinates of the picture, each part before the boxes in it."""
        self.x, self.y = x, y
        for box in self.boxes:
            yield {"id": box.id, "x": x + box.x, "y": y + box.y, "width": box.width, "height": box.height}
            if level := self.inner.get(box.id):
                yield from level.shapes(x + box.x, y + box.y)


def _least_width(node: Shape) -> float:
    """Return the width that the title of a part needs."""
    wanted = str(node.get("layoutOptions", {}).get("elk.nodeSize.minimum", ""))
    found = re.match(r"\(([\d.]+),", wanted)
    return float(found[1]) if found else 0.0


def _common(one: list[tuple[_Level, Box]], other: list[tuple[_Level, Box]]) -> int:
    """Return the index of the innermost level that two ports share."""
    return sum(a[0] is b[0] for a, b in zip(one, other, strict=False)) - 1


def _take(trails: dict[str, list[tuple[_Level, Box]]], source: str, target: str) -> None:
    """Add a wire to the nets of all levels that it passes."""
    out, into = trails[source], trails[target]
    common = _common(out, into)
    for place, (level, box) in enumerate(out[common:], common):
        level.net(source, box).leaves |= place > common
    for place, (level, box) in enumerate(into[common:], common):
        net = level.net(source, None)
        net.reach_for(box, target if place == len(into) - 1 else source)


def _corners(trails: dict[str, list[tuple[_Level, Box]]], source: str, target: str) -> list[dict[str, float]]:
    """Return the corners of a wire in the coordinates of the picture."""
    out, into = trails[source], trails[target]
    common = _common(out, into)
    way: list[Point] = []
    for level, _ in reversed(out[common + 1 :]):
        way += _moved(level, level.nets[source].way_out)
    for place, (level, box) in enumerate(into[common:], common):
        port = target if place == len(into) - 1 else source
        way += _moved(level, level.nets[source].ways[box.id, port])
    return [{"x": x, "y": y} for x, y in _simplified(way)]


def _moved(level: _Level, way: Iterable[Point]) -> Iterator[Point]:
    return ((level.x + x, level.y + y) for x, y in way)


def _simplified(way: list[Point]) -> list[Point]:
    """Leave out the corners at which the way does not turn."""
    kept = way[:1]
    for here, after in pairwise(way[1:]):
        before = kept[-1]
        if here != before and not (before[0] == here[0] == after[0] or before[1] == here[1] == after[1]):
            kept.append(here)
    return [*kept, way[-1]]
