"""A drawing before it is placed: blocks and wires with every reference resolved and every size known."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.graph.graph import CONTINUOUS
from quadvis.output import svg
from quadvis.output.drawn import ARROW, INDENT, PORT, DrawnBlock, DrawnWire, Mark
from quadvis.output.forms import Colours, form_of

# Fill and line of the solver and of each task in the order of the legend: tints on which black text stays
# legible, lines that the colour-blind can distinguish (after Okabe and Ito, darkened).
_SOLVER_COLOURS = ("#ffffff", "#222222")
_TASK_COLOURS = (
    ("#dcecf8", "#005f9e"),
    ("#fdebd3", "#b35900"),
    ("#d9f2e8", "#00755a"),
    ("#f6e1ee", "#a3336f"),
    ("#e6e4f5", "#5a4aa8"),
    ("#f4f0cf", "#7d6b00"),
)
PILL_COLOURS = ("#fff3b0", "#9a7b00")

_OPTIONS = {
    "elk.algorithm": "layered",
    "elk.direction": "RIGHT",
    "elk.edgeRouting": "ORTHOGONAL",
    "elk.hierarchyHandling": "INCLUDE_CHILDREN",
    # A walk from the sources cuts each loop where it comes back to its beginning, so that only one wire
    # returns. The default strategy cut a hover diagram in four places.
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
# For a sheet of paper: the columns go on below one another, like lines of a text, and stand closer. This
# strategy cuts loops at as few wires as it can; each would go around all lines.
_WRAPPED = {
    "elk.layered.cycleBreaking.strategy": "GREEDY",
    "elk.layered.wrapping.strategy": "MULTI_EDGE",
    "elk.layered.wrapping.additionalEdgeSpacing": 0,
    "elk.spacing.nodeNode": 16,
    "elk.spacing.edgeNode": 9,
    "elk.spacing.edgeEdge": 7,
    "elk.layered.spacing.nodeNodeBetweenLayers": 16,
    "elk.layered.spacing.edgeNodeBetweenLayers": 9,
    "elk.layered.spacing.edgeEdgeBetweenLayers": 7,
}


class Drawing:
    """The diagram with every reference resolved and every size known; the layout engine finds positions.

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
        self.marks = {self._port("i", *at): Mark(value, constant=True) for at, value in constants.items()}
        self.ends = [self._ends(wire) for wire in wires]
        self.forms = [form_of(block) for block in blocks]

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
            self.marks[target] = Mark(words, crossing=wire.crossing is not None)
        return self._port("o", path, port), target

    def colours_of(self, number: int) -> Colours:
        """Return the fill and line of a block."""
        return Colours(*self.colours[self.blocks[number].task])

    def inset(self, port: str) -> float:
        """Return how far a wire goes on from the side of the room for a block to its outline."""
        number, _, rest = port[1:].partition(".")
        form, row = self.forms[int(number)], int(rest[1:])
        return form.inputs[row][0] if rest[0] == "i" else form.width - form.outputs[row][0]

    def reach(self, port: str) -> float:
        """Return the length of arrow and mark before an input: the layout engine ends the wire there."""
        mark = self.marks.get(port)
        return ARROW + (mark.width + INDENT if mark else 0.0)

    def graph(self, aspect: float | None = None) -> dict[str, Any]:
        """Return the graph in the engine's format, parts as nodes around the nodes of their blocks.

        With ``aspect``, about the width divided by the height, its columns are wrapped.
        """
        options = _OPTIONS if aspect is None else {**_OPTIONS, **_WRAPPED, "elk.aspectRatio": aspect}
        root: dict[str, Any] = {"id": "root", "layoutOptions": options, "children": []}
        parts = {"": root}
        for number, block in enumerate(self.blocks):
            _part_node(block.path.rpartition("/")[0], parts)["children"].append(self._node(number, block))
        ends = enumerate(self.ends)
        root["edges"] = [{"id": f"w{i}", "sources": [a], "targets": [b]} for i, (a, b) in ends]
        return root

    def _node(self, number: int, block: DrawnBlock) -> dict[str, Any]:
        form = self.forms[number]
        inputs = [(f"b{number}.i{row}", height) for row, (_, height) in enumerate(form.inputs)]
        outputs = [(f"b{number}.o{row}", height) for row, (_, height) in enumerate(form.outputs)]
        return {
            "id": f"b{number}",
            "width": form.width,
            "height": form.height,
            "layoutOptions": {"elk.portConstraints": "FIXED_POS"},
            "ports": [
                *(_port_node(port, "WEST", -self.reach(port), height) for port, height in inputs),
                *(_port_node(port, "EAST", form.width, height) for port, height in outputs),
            ],
        }


def _port_node(name: str, side: str, x: float, y: float) -> dict[str, Any]:
    size = {"width": max(-x, 0), "height": 0}
    return {"id": name, "x": x, "y": y, **size, "layoutOptions": {"elk.port.side": side}}


def _part_node(path: str, parts: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the node of a part; make it, and the parts around it, if necessary."""
    if path not in parts:
        outer, _, name = path.rpartition("/")
        least = svg.text_width(name, PORT, bold=True) + 4 * INDENT
        options = _OPTIONS | {
            "elk.padding": "[top=30,left=14,bottom=14,right=14]",
            "elk.nodeSize.constraints": "MINIMUM_SIZE",
            "elk.nodeSize.minimum": f"({least},30)",
        }
        parts[path] = {"id": f"p{path}", "layoutOptions": options, "children": []}
        _part_node(outer, parts)["children"].append(parts[path])
    return parts[path]
