"""Blocks with an outline of their own: the circle of a sum, the triangle of a gain, the bar of a bundle.

The name stands above, and wires run on to the outline below it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from quadvis.output import svg
from quadvis.output.drawn import INK, MAIN, NAME, PORT, ROW
from quadvis.output.forms import Colours, Form, Point, main_lines

NAMED = 19.0  # height of the name above
STROKE = 3.5  # half the length of a stroke of a sign


class Outlined(Form):
    """An outline of a width and height, `shape`, below a name; ports are level with its middle."""

    @property
    def shape(self) -> Point:
        """Width and height of the outline."""
        raise NotImplementedError

    @property
    def below(self) -> tuple[str, ...]:
        """The lines below the outline."""
        return self.block.main

    def size(self) -> Point:
        """Return width and height, with the name and the lines below."""
        texts = [svg.text_width(text, PORT) for text in self.below]
        width = max(self.shape[0], svg.text_width(self.name, NAME, bold=True), *texts, 0.0)
        return width, NAMED + self.shape[1] + MAIN * len(self.below)

    @property
    def left(self) -> float:
        """Where the outline begins."""
        return (self.width - self.shape[0]) / 2

    def row(self, row: int) -> float:
        """Return the distance of a row of inputs from the top."""
        return self._row(row, len(self.block.inputs))

    def _row(self, row: int, count: int) -> float:
        return NAMED + self.shape[1] / 2 + (row - (count - 1) / 2) * ROW

    def input(self, row: int) -> Point:
        """Return where the wire of an input ends."""
        return self.left, self.row(row)

    def output(self, row: int) -> Point:
        """Return where the wires of an output begin."""
        return self.left + self.shape[0], self._row(row, len(self.block.outputs))

    def elements(self, x: float, y: float, colours: Colours) -> Iterator[str]:
        """Yield the elements with the upper left corner at (x, y)."""
        middle = x + self.width / 2
        yield svg.text(self.name, middle, y + 12, NAME, bold=True, anchor="middle", class_="name")
        yield from self.outline(x + self.left, y + NAMED, colours)
        yield from main_lines(self.below, middle, y + NAMED + self.shape[1] + 11)


class SumCircle(Outlined):
    """A circle with a sign at each input."""

    MOST = 5  # inputs, beyond which a circle would be large

    @property
    def radius(self) -> float:
        """The radius at which all inputs have room."""
        return max(16.0, math.hypot((len(self.block.inputs) - 1) / 2 * ROW, 14.0))

    @property
    def shape(self) -> Point:
        """Width and height of the circle."""
        return 2 * self.radius, 2 * self.radius

    def input(self, row: int) -> Point:
        """Return where the wire of an input ends."""
        height = self.row(row)
        along = math.sqrt(self.radius**2 - (height - NAMED - self.radius) ** 2)
        return self.left + self.radius - along, height

    def outline(self, x: float, y: float, colours: Colours) -> Iterator[str]:
        """Yield circle and signs."""
        r = self.radius
        yield svg.element(
            "circle", cx=x + r, cy=y + r, r=r, fill=colours.fill, stroke=colours.line,
            stroke_width=colours.width, class_="outline",
        )  # fmt: skip
        for name, (_, height) in zip(self.block.inputs, self.inputs, strict=True):
            sign = self.block.signs.get(name, "")
            # Level with its wire, but not so near the top or bottom that it would touch the circle.
            aside = max(STROKE - r + 5.0, min(r - 5.0 - STROKE, height - NAMED - r))
            along = math.sqrt((r - 2.0) ** 2 - (abs(aside) + STROKE) ** 2) - STROKE
            if sign in ("+", "-"):
                yield from _sign(sign, x + r - along, y + r + aside)


class GainTriangle(Outlined):
    """A triangle around the factor; a long factor stands below it."""

    LONGEST = 64.0  # pixels of a text inside

    @property
    def inside(self) -> str:
        """The text in the triangle."""
        (text,) = self.block.main if len(self.block.main) == 1 else ("K",)
        return text if svg.text_width(text, PORT) <= self.LONGEST else "K"

    @property
    def below(self) -> tuple[str, ...]:
        """The lines below the outline."""
        return () if (self.inside,) == self.block.main else self.block.main

    @property
    def shape(self) -> Point:
        """Width and height of the triangle."""
        width = max(34.0, (svg.text_width(self.inside, PORT) + 9) / 0.72)
        return width, max(36.0, 0.6 * width)

    def outline(self, x: float, y: float, colours: Colours) -> Iterator[str]:
        """Yield triangle and factor."""
        width, height = self.shape
        corners = svg.points([(x, y), (x + width, y + height / 2), (x, y + height)])
        yield svg.element(
            "polygon", points=corners, fill=colours.fill, stroke=colours.line, stroke_width=colours.width,
            stroke_linejoin="round", class_="outline",
        )  # fmt: skip
        yield svg.text(self.inside, x + 5, y + height / 2 + 4, PORT, class_="port")


class SignalBar(Outlined):
    """A bar in which signals become one, or one becomes several."""

    @property
    def shape(self) -> Point:
        """Width and height of the bar."""
        return 7.0, self.rows * ROW + 6

    def outline(self, x: float, y: float, colours: Colours) -> Iterator[str]:
        """Yield the bar."""
        width, height = self.shape
        yield svg.element(
            "rect", x=x, y=y, width=width, height=height, rx=1, fill=colours.line, stroke=colours.line,
            stroke_width=colours.width, class_="outline",
        )  # fmt: skip


def _sign(sign: str, x: float, y: float) -> Iterator[str]:
    """Yield a plus or a minus as lines, which look alike in every typeface."""
    arms = [((x - STROKE, y), (x + STROKE, y))]
    arms += [((x, y - STROKE), (x, y + STROKE))] if sign == "+" else []
    for arm in arms:
        yield svg.element("polyline", points=svg.points(arm), fill="none", stroke=INK, stroke_width=1.4)
