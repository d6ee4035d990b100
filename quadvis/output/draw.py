"""Draw a block diagram as SVG: boxes with named ports, orthogonal wires, colours by rate.

The Eclipse Layout Kernel's layered algorithm places the boxes and routes the wires; it is made for diagrams
with ports (see `quadvis/output/elkjs`). Large diagrams are placed by `quadvis.output.layers`. This module
states the sizes, and draws what was placed.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from quadvis.engine.graph import CONTINUOUS
from quadvis.errors import QuadvisError
from quadvis.output import elkjs as engine
from quadvis.output import layers, svg
from quadvis.output.elkjs import LayoutError

MOST_BLOCKS, MOST_WIRES = 250, 750
"""The engine takes half a minute for so many."""


@dataclass(frozen=True)
class DrawnBlock:
    """A box: `path` is its name with the parts around it ("vision/detector"), `kind` its type in YAML."""

    path: str
    kind: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    task: str


@dataclass(frozen=True)
class DrawnWire:
    """A wire from `source` ("block.port" or "block.port[0]"); `crossing` says how it changes rates, if so."""

    source: str
    target_block: str
    target_port: str
    crossing: str | None = None


def draw(
    title: str,
    blocks: Sequence[DrawnBlock],
    wires: Sequence[DrawnWire],
    constants: Mapping[tuple[str, str], str],
    tasks: Mapping[str, str],
) -> str:
    """Return the diagram as the text of an SVG file; equal arguments give equal text.

    The blocks come in reading order: where a loop has no source of its own, it starts at its first block.
    `constants` are the values set at inputs, by (block, port). `tasks` are the words of the legend by task
    name, `CONTINUOUS` among them. Raises `QuadvisError` if the arguments contradict each other or the layout
    engine is missing; what it cannot place is placed by a simpler layout.
    """
    plan = _Plan(blocks, wires, constants, tasks)
    placed = {shape["id"]: shape for shape in _shapes(_laid_out(plan))}
    return _page(title, plan, placed)


def _laid_out(plan: _Plan) -> dict[str, Any]:
    """Return the graph with positions: the engine's, or those of a simpler layout if there is much of it."""
    graph = plan.graph()
    if len(plan.blocks) <= MOST_BLOCKS and len(plan.wires) <= MOST_WIRES:
        with suppress(LayoutError):
            return engine.layout(graph)
    return layers.layout(graph)


# Sizes in CSS pixels: fonts, then distances.
_TITLE, _NAME, _PORT, _SMALL = 18.0, 13.0, 11.0, 10.0
_MARGIN, _LINE, _HEADER, _ROW, _INDENT, _BETWEEN, _ARROW = 24.0, 26.0, 38.0, 17.0, 7.0, 18.0, 9.0
_LONGEST_MARK = 28

# Fill and line of the solver and of each task in the order of the legend: tints on which black text stays
# legible, lines that the colour-blind can tell apart (after Okabe and Ito, darkened).
_SOLVER_COLOURS = ("#ffffff", "#222222")
_TASK_COLOURS = (
    ("#dcecf8", "#005f9e"),
    ("#fdebd3", "#b35900"),
    ("#d9f2e8", "#00755a"),
    ("#f6e1ee", "#a3336f"),
    ("#e6e4f5", "#5a4aa8"),
    ("#f4f0cf", "#7d6b00"),
)
_PILL_COLOURS = ("#fff3b0", "#9a7b00")

_OPTIONS = {
    "elk.algorithm": "layered",
    "elk.direction": "RIGHT",
    "elk.edgeRouting": "ORTHOGONAL",
    "elk.hierarchyHandling": "INCLUDE_CHILDREN",
    # A walk from the sources cuts each loop where it comes back to its beginning, so that one wire returns;
    # the default strategy cut a hover diagram in four places.
    "elk.layered.cycleBreaking.strategy": "DEPTH_FIRST",
    "elk.layered.crossingMinimization.greedySwitchHierarchical.type": "TWO_SIDED",
    "elk.json.shapeCoords": "ROOT",
    "elk.json.edgeCoords": "ROOT",
    "elk.padding": "[top=14,left=14,bottom=14,right=14]",
    "elk.spacing.nodeNode": 26,
    "elk.spacing.edgeNode": 14,
    "elk.spacing.edgeEdge": 9,
    "elk.layered.spacing.nodeNodeBetweenLayers": 30,
    "elk.layered.spacing.edgeNodeBetweenLayers": 14,
    "elk.layered.spacing.edgeEdgeBetweenLayers": 9,
}


@dataclass(frozen=True)
class _Mark:
    """What stands before an input: which elements its wire takes and how it crosses rates, or a constant."""

    text: str
    crossing: bool = False
    constant: bool = False

    @property
    def shown(self) -> str:
        return self.text if len(self.text) <= _LONGEST_MARK else self.text[: _LONGEST_MARK - 1] + "…"

    @property
    def width(self) -> float:
        return svg.text_width(self.shown, _SMALL) + _INDENT


class _Plan:
    """The diagram with every reference resolved and every size known; positions are left to the engine.

    Block number 3 and its first ports have the ids "b3", "b3.i0", "b3.o0"; wires "w5"; parts "p" + path.
    """

    def __init__(
        self,
        blocks: Sequence[DrawnBlock],
        wires: Sequence[DrawnWire],
        constants: Mapping[tuple[str, str], str],
        tasks: Mapping[str, str],
    ) -> None:
        self.blocks, self.wires, self.tasks = blocks, wires, tasks
        discrete = (name for name in tasks if name != CONTINUOUS)
        self.colours = {CONTINUOUS: _SOLVER_COLOURS, **dict(zip(discrete, itertools.cycle(_TASK_COLOURS)))}
        self._numbers: dict[str, int] = {}
        for number, block in enumerate(blocks):
            if self._numbers.setdefault(block.path, number) != number:
                raise QuadvisError(f"block '{block.path}' is drawn twice; paths must differ")
            if block.task not in tasks:
                raise QuadvisError(f"block '{block.path}': task '{block.task}' is not in the legend; add it")
        self.marks = {self._port("i", *at): _Mark(value, constant=True) for at, value in constants.items()}
        self.ends = [self._ends(wire) for wire in wires]

    def _port(self, side: str, path: str, port: str) -> str:
        """Return the id of an input ("i") or output ("o")."""
        if path not in self._numbers:
            raise QuadvisError(f"block '{path}' is not among the blocks to draw; add it")
        number = self._numbers[path]
        block, word = self.blocks[number], "input" if side == "i" else "output"
        names = block.inputs if side == "i" else block.outputs
        if port not in names:
            raise QuadvisError(f"block '{path}' has no {word} '{port}'; it has {', '.join(names) or 'none'}")
        return f"b{number}.{side}{names.index(port)}"

    def _ends(self, wire: DrawnWire) -> tuple[str, str]:
        """Return the ids of the two ports of a wire, and note the mark at the second."""
        found = re.fullmatch(r"(.+)\.([^.\[\]]+)((?:\[.*\])?)", wire.source, re.DOTALL)
        if found is None:
            raise QuadvisError(f"a wire starts at '{wire.source}'; it must start at 'block.port'")
        path, port, elements = found.groups()
        target = self._port("i", wire.target_block, wire.target_port)
        if words := f"{elements} {wire.crossing or ''}".strip():
            self.marks[target] = _Mark(words, crossing=wire.crossing is not None)
        return self._port("o", path, port), target

    def colours_of(self, number: int) -> tuple[str, str]:
        """Return the fill and line of a block."""
        return self.colours[self.blocks[number].task]

    def reach(self, port: str) -> float:
        """Return how far arrow and mark stand out of the box at an input: there the engine ends the wire."""
        mark = self.marks.get(port)
        return _ARROW + (mark.width + _INDENT if mark else 0.0)

    def graph(self) -> dict[str, Any]:
        """Return the graph in the engine's format, parts as nodes around the nodes of their blocks."""
        root: dict[str, Any] = {"id": "root", "layoutOptions": _OPTIONS, "children": []}
        parts = {"": root}
        for number, block in enumerate(self.blocks):
            _part_node(block.path.rpartition("/")[0], parts)["children"].append(self._node(number, block))
        ends = enumerate(self.ends)
        root["edges"] = [{"id": f"w{i}", "sources": [a], "targets": [b]} for i, (a, b) in ends]
        return root

    def _node(self, number: int, block: DrawnBlock) -> dict[str, Any]:
        sides = block.inputs, block.outputs
        columns = [max((svg.text_width(name, _PORT) for name in names), default=0.0) for names in sides]
        head = max(svg.text_width(_last(block.path), _NAME, bold=True), svg.text_width(block.kind, _SMALL))
        width = 2 * _INDENT + max(head, sum(columns) + _BETWEEN * all(columns))
        inputs = [f"b{number}.i{row}" for row in range(len(block.inputs))]
        rows = max(map(len, sides))
        return {
            "id": f"b{number}",
            "width": width,
            "height": _HEADER + rows * _ROW + (4 if rows else 0),
            "layoutOptions": {"elk.portConstraints": "FIXED_POS"},
            "ports": [
                *(_port_node(port, "WEST", -self.reach(port), row) for row, port in enumerate(inputs)),
                *(_port_node(f"b{number}.o{row}", "EAST", width, row) for row in range(len(block.outputs))),
            ],
        }


def _port_node(name: str, side: str, x: float, row: int) -> dict[str, Any]:
    size = {"width": max(-x, 0), "height": 0}
    return {"id": name, "x": x, "y": _row(row), **size, "layoutOptions": {"elk.port.side": side}}


def _part_node(path: str, parts: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the node of a part, made with the parts around it if need be."""
    if path not in parts:
        outer, _, name = path.rpartition("/")
        least = svg.text_width(name, _PORT, bold=True) + 4 * _INDENT
        options = _OPTIONS | {
            "elk.padding": "[top=30,left=14,bottom=14,right=14]",
            "elk.nodeSize.constraints": "MINIMUM_SIZE",
            "elk.nodeSize.minimum": f"({least},30)",
        }
        parts[path] = {"id": f"p{path}", "layoutOptions": options, "children": []}
        _part_node(outer, parts)["children"].append(parts[path])
    return parts[path]


def _row(row: int) -> float:
    return _HEADER + (row + 0.5) * _ROW


def _last(path: str) -> str:
    return path.rpartition("/")[2]


def _shapes(node: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield node
    yield from node.get("ports", ())
    yield from node.get("edges", ())
    for child in node.get("children", ()):
        yield from _shapes(child)


def _page(title: str, plan: _Plan, placed: Mapping[str, dict[str, Any]]) -> str:
    """Return title, legend and diagram: parts undermost, then wires, then boxes."""
    legend, legend_width = _legend(plan)
    root, top = placed["root"], _MARGIN + 2 * _LINE
    width = 2 * _MARGIN + max(root["width"], legend_width, svg.text_width(title, _TITLE, bold=True))
    height = top + root["height"] + _MARGIN
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
        svg.text(title, _MARGIN, _MARGIN + 12, _TITLE, bold=True),
        svg.opening("g", transform=f"translate({_MARGIN} {_MARGIN + _LINE})"),
        *legend,
        "</g>",
        svg.opening("g", transform=f"translate({_MARGIN} {top})"),
    ]
    for shape in placed.values():
        if shape["id"].startswith("p"):
            lines += _part(shape)
    for number in range(len(plan.wires)):
        lines += _wire(plan, number, placed[f"w{number}"])
    for number in range(len(plan.blocks)):
        lines += _block(plan, number, placed[f"b{number}"])
    return "\n".join([*lines, "</g>", "</svg>", ""])


def _legend(plan: _Plan) -> tuple[list[str], float]:
    """Return the elements of the legend, all on one line, and its length."""
    entries = [(label, plan.colours[task], 2) for task, label in plan.tasks.items()]
    if any(mark.crossing for mark in plan.marks.values()):
        entries.append(("how a wire crosses rates", _PILL_COLOURS, 6))
    lines, x = [], 0.0
    for label, (fill, line), radius in entries:
        lines.append(svg.element("rect", x=x, y=0, width=20, height=12, rx=radius, fill=fill, stroke=line))
        lines.append(svg.text(label, x + 26, 10, _PORT))
        x += 26 + svg.text_width(label, _PORT) + 20
    return lines, x


def _part(shape: Mapping[str, Any]) -> Iterator[str]:
    path, x, y = shape["id"][1:], shape["x"], shape["y"]
    size = {"x": x, "y": y, "width": shape["width"], "height": shape["height"]}
    yield svg.opening("g", class_="part", data_path=path)
    yield svg.element("rect", **size, rx=6, fill="#f6f7f8", stroke="#8a8f98", stroke_dasharray="5 3")
    yield svg.text(_last(path), x + 2 * _INDENT, y + 19, _PORT, bold=True, fill="#4a4f57")
    yield "</g>"


def _wire(plan: _Plan, number: int, shape: Mapping[str, Any]) -> Iterator[str]:
    wire, (source, target) = plan.wires[number], plan.ends[number]
    colour = plan.colours_of(int(source[1:].partition(".")[0]))[1]
    (section,) = shape["sections"]
    corners = [section["startPoint"], *section.get("bendPoints", ()), section["endPoint"]]
    x, y = corners[-1]["x"] + plan.reach(target), corners[-1]["y"]
    line = svg.points([*((corner["x"], corner["y"]) for corner in corners), (x, y)])
    end = f"{wire.target_block}.{wire.target_port}"
    yield svg.opening("g", class_="wire", data_source=wire.source, data_target=end)
    yield svg.element("title", f"{wire.source} → {end}" + (f" ({wire.crossing})" if wire.crossing else ""))
    yield svg.element("polyline", points=line, fill="none", stroke=colour, stroke_width=1.3)
    yield svg.element("polygon", points=svg.points([(x, y), (x - 7, y - 3), (x - 7, y + 3)]), fill=colour)
    for junction in shape.get("junctionPoints", ()):
        yield svg.element("circle", cx=junction["x"], cy=junction["y"], r=2.6, fill=colour)
    yield "</g>"


def _block(plan: _Plan, number: int, shape: Mapping[str, Any]) -> Iterator[str]:
    block, (fill, line) = plan.blocks[number], plan.colours_of(number)
    x, y, width = shape["x"], shape["y"], shape["width"]
    size = {"x": x, "y": y, "width": width, "height": shape["height"]}
    middle = x + width / 2
    yield svg.opening("g", class_="block", data_path=block.path)
    yield svg.element("rect", **size, rx=3, fill=fill, stroke=line, stroke_width=1.5)
    yield svg.text(_last(block.path), middle, y + 16, _NAME, bold=True, anchor="middle")
    yield svg.text(block.kind, middle, y + 29, _SMALL, anchor="middle", fill="#444444")
    for row, name in enumerate(block.inputs):
        if mark := plan.marks.get(f"b{number}.i{row}"):
            yield from _mark(mark, x, y + _row(row))
        yield svg.text(name, x + _INDENT, y + _row(row) + 4, _PORT)
    for row, name in enumerate(block.outputs):
        yield svg.text(name, x + width - _INDENT, y + _row(row) + 4, _PORT, anchor="end")
    yield "</g>"


def _mark(mark: _Mark, x: float, y: float) -> Iterable[str]:
    """Yield the mark before the input at (x, y)."""
    left = x - _ARROW - mark.width
    size = {"x": left, "y": y - 7, "width": mark.width, "height": 14}
    fill, line = _PILL_COLOURS if mark.crossing else ("#ffffff", "none")
    yield svg.opening("g", class_="mark")
    yield svg.element("title", mark.text)
    if mark.constant:
        yield svg.text(mark.shown, x - _ARROW - 3, y + 3.5, _SMALL, anchor="end", fill="#333333")
        yield svg.element("polyline", points=svg.points([(x - _ARROW, y), (x, y)]), stroke="#555555")
    else:
        yield svg.element("rect", **size, rx=7, fill=fill, stroke=line)
        yield svg.text(mark.shown, left + mark.width / 2, y + 3.5, _SMALL, anchor="middle", fill="#333333")
    yield "</g>"
