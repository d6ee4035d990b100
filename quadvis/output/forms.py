"""The form of each block: its size, where its wires end, and its elements.

A block without a symbol is a box with name, type, main parameters and the names of its ports. With a symbol
or a formula it is a box around that, or, for a sum, a gain and a bar, has an outline of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from quadvis.block.symbol import BAR, CURVES, GAIN, SUM
from quadvis.output import glyphs, svg
from quadvis.output.drawn import (
    BETWEEN,
    FOOT,
    HEADER,
    INDENT,
    INK,
    MAIN,
    NAME,
    PORT,
    ROW,
    SMALL,
    DrawnBlock,
    last,
)

TOP = 23.0  # of a box with a symbol: the height of its name
FORMULA, FORMULA_LINE = 14.0, 17.0  # size of the type of a formula, and the height of a line of it
GAP = 6.0  # around a symbol

Point = tuple[float, float]


@dataclass(frozen=True)
class Colours:
    """Fill and line of a block, and the width of the line."""

    fill: str
    line: str
    width: float = 1.5


class Form:
    """A block as a box with its type. ``inputs`` and ``outputs`` are where wires end, from the upper left."""

    def __init__(self, block: DrawnBlock) -> None:
        self.block = block
        self.name = last(block.path)
        self.width, self.height = self.size()
        self.inputs = tuple(self.input(row) for row in range(len(block.inputs)))
        self.outputs = tuple(self.output(row) for row in range(len(block.outputs)))

    @property
    def rows(self) -> int:
        """How many rows of ports there are."""
        return max(len(self.block.inputs), len(self.block.outputs))

    @property
    def head(self) -> float:
        """The height of name, type and main parameters."""
        return HEADER + MAIN * len(self.block.main)

    @property
    def foot(self) -> float:
        """The height of the lines at the foot."""
        return len(self.block.lines) * FOOT + (INDENT if self.block.lines else 0.0)

    def columns(self) -> tuple[float, float]:
        """Return the widths of the names of inputs and of outputs."""
        block = self.block
        labels = [block.signs.get(name, name) for name in block.inputs]
        return _widest(labels, PORT), _widest(block.outputs, PORT)

    def size(self) -> tuple[float, float]:
        """Return width and height."""
        block, columns = self.block, self.columns()
        texts = svg.text_width(self.name, NAME, bold=True), svg.text_width(block.kind, SMALL)
        wide = max(*texts, _widest(block.main, PORT), _widest(block.lines, SMALL))
        width = 2 * INDENT + max(wide, sum(columns) + BETWEEN * all(columns))
        return width, self.head + self.rows * ROW + (4 if self.rows else 0) + self.foot

    def row(self, row: int) -> float:
        """Return the distance of a row of ports from the top."""
        return self.head + (row + 0.5) * ROW

    def input(self, row: int) -> Point:
        """Return where the wire of an input ends."""
        return 0.0, self.row(row)

    def output(self, row: int) -> Point:
        """Return where the wires of an output begin."""
        return self.width, self.row(row)

    def elements(self, x: float, y: float, colours: Colours) -> Iterator[str]:
        """Yield the elements with the upper left corner at (x, y)."""
        block, middle = self.block, x + self.width / 2
        yield from self.outline(x, y, colours)
        yield svg.text(self.name, middle, y + 16, NAME, bold=True, anchor="middle", class_="name")
        yield svg.text(block.kind, middle, y + 29, SMALL, anchor="middle", fill="#444444", class_="kind")
        yield from main_lines(block.main, middle, y + HEADER + 6)
        yield from self.labels(x, y)
        foot = y + self.height - self.foot
        for number, text in enumerate(block.lines, 1):
            yield svg.text(text, x + INDENT, foot + number * FOOT - 3, SMALL, fill="#333333", class_="port")

    def outline(self, x: float, y: float, colours: Colours) -> Iterator[str]:
        """Yield the box."""
        size = {"x": x, "y": y, "width": self.width, "height": self.height}
        yield svg.element(
            "rect",
            **size,
            rx=3,
            fill=colours.fill,
            stroke=colours.line,
            stroke_width=colours.width,
            class_="outline",
        )

    def labels(self, x: float, y: float) -> Iterator[str]:
        """Yield the names of the ports."""
        for name, (_, height) in zip(self.block.inputs, self.inputs, strict=True):
            text = self.block.signs.get(name, name)
            yield svg.text(text, x + INDENT, y + height + 4, PORT, class_="port")
        for name, (_, height) in zip(self.block.outputs, self.outputs, strict=True):
            right = x + self.width - INDENT
            yield svg.text(name, right, y + height + 4, PORT, anchor="end", class_="port")


class SymbolBox(Form):
    """A box with name, symbol or formula, and main parameters; ports have names where there are several."""

    @property
    def inner(self) -> tuple[float, float]:
        """Width and height of what stands between the ports: a curve, a formula, the main parameters."""
        formula, main = self.block.formula, self.block.main
        if self.block.symbol in CURVES:
            wide, high = glyphs.WIDTH, glyphs.HEIGHT
        else:
            wide, high = _widest(formula, FORMULA), formula_height(formula)
        return max(wide, _widest(main, PORT)), high + MAIN * len(main) + (3.0 if main and high else 0.0)

    @property
    def body(self) -> float:
        """The height below the name."""
        return max(self.rows * ROW, self.inner[1]) + GAP

    def columns(self) -> tuple[float, float]:
        """Return the widths of the names of ports; none, where they cannot be confused."""
        inputs, outputs = super().columns()
        alone = len(self.block.inputs) < 2 and len(self.block.outputs) < 2
        return (0.0, 0.0) if alone else (inputs, outputs if len(self.block.outputs) > 1 else 0.0)

    def size(self) -> tuple[float, float]:
        """Return width and height."""
        inputs, outputs = self.columns()
        sides = 2 * max(inputs, outputs)  # so that the symbol stands in the middle
        inner = self.inner[0] + sides + (2 * GAP if sides else 0.0)
        width = 2 * INDENT + max(svg.text_width(self.name, NAME, bold=True), inner)
        return width, TOP + self.body

    def row(self, row: int) -> float:
        """Return the distance of a row of inputs from the top."""
        return self._row(row, len(self.block.inputs))

    def output(self, row: int) -> Point:
        """Return where the wires of an output begin."""
        return self.width, self._row(row, len(self.block.outputs))

    def _row(self, row: int, count: int) -> float:
        """Rows are level with the middle of the symbol."""
        return TOP + (self.body - GAP) / 2 + (row - (count - 1) / 2) * ROW

    def elements(self, x: float, y: float, colours: Colours) -> Iterator[str]:
        """Yield the elements with the upper left corner at (x, y)."""
        block, middle = self.block, x + self.width / 2
        yield from self.outline(x, y, colours)
        yield svg.text(self.name, middle, y + 16, NAME, bold=True, anchor="middle", class_="name")
        top = y + TOP + (self.body - GAP - self.inner[1]) / 2
        if block.symbol in CURVES:
            yield from glyphs.glyph(block.symbol, middle - glyphs.WIDTH / 2, top)
            top += glyphs.HEIGHT + 3
        elif block.formula:
            yield from formula_elements(block.formula, middle, top)
            top += formula_height(block.formula) + 3
        yield from main_lines(block.main, middle, top + 10)
        inputs, outputs = self.columns()
        labels = list(self.labels(x, y))
        yield from labels[: len(block.inputs)] if inputs else ()
        yield from labels[len(block.inputs) :] if outputs else ()


def form_of(block: DrawnBlock) -> Form:
    """Return the form of a block."""
    from quadvis.output.outlines import GainTriangle, SignalBar, SumCircle

    if block.symbol == SUM and len(block.inputs) <= SumCircle.MOST and len(block.outputs) == 1:
        return SumCircle(block)
    if block.symbol == GAIN and len(block.inputs) == 1 == len(block.outputs):
        return GainTriangle(block)
    if block.symbol == BAR and block.inputs and block.outputs:
        return SignalBar(block)
    return SymbolBox(block) if block.symbol or block.formula else Form(block)


def main_lines(texts: Sequence[str], middle: float, y: float) -> Iterator[str]:
    """Yield lines of main parameters, the first base line at a height."""
    for number, text in enumerate(texts):
        yield svg.text(text, middle, y + number * MAIN, PORT, anchor="middle", class_="port")


def formula_height(formula: Sequence[str]) -> float:
    """Return the height of a formula, or of a fraction with its line; of none, 0."""
    return len(formula) * FORMULA_LINE + (2.0 if len(formula) > 1 else 0.0)


def formula_elements(formula: Sequence[str], middle: float, top: float) -> Iterator[str]:
    """Yield a formula, or a fraction, from its top on."""
    yield svg.text(formula[0], middle, top + 13, FORMULA, anchor="middle", class_="formula")
    if len(formula) > 1:
        half = _widest(formula, FORMULA) / 2
        height = top + FORMULA_LINE + 0.5
        line = svg.points([(middle - half, height), (middle + half, height)])
        yield svg.element("polyline", points=line, fill="none", stroke=INK)
        last_line = top + formula_height(formula) - 5
        yield svg.text(formula[1], middle, last_line, FORMULA, anchor="middle", class_="formula")


def _widest(texts: Sequence[str], size: float) -> float:
    return max((svg.text_width(text, size) for text in texts), default=0.0)
