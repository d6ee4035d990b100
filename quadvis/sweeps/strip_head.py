"""What stands above the panels of a picture of many runs: title, subtitle and legend, cut to fit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from quadvis.output.panel import BESIDE, BETWEEN
from quadvis.output.style import POINT, STYLE, fitted, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

TOP = 0.7  # inches: height of a title in one line and the subtitle
EDGE = 0.15  # inches: the left and the right margin of the picture
GAP = 0.2  # inches between texts that stand side by side
LINES = 1.5  # distance of lines, times the size of the letters
MOST_LABELS = 12  # of the legend
MOST_COLUMNS = 6
LONGEST_NAME = 3.0  # inches of a label; where all labels have more room, they take it
GREY = "#555555"


@dataclass(frozen=True)
class Head:
    """All texts, in lines, and the place of the legend: beside the title or below it."""

    title: str
    subtitle: str
    legend: str
    labels: tuple[str, ...]
    columns: int
    is_below: bool

    @property
    def top(self) -> float:
        """The height of title and subtitle (inches)."""
        return TOP + more_lines(self.title, STYLE["figure.titlesize"])

    @property
    def height(self) -> float:
        """The height of everything (inches)."""
        if not self.is_below:
            return self.top
        lines = math.ceil(len(self.labels) / self.columns) + 1 + self.legend.count("\n")
        return self.top + float(lines * LINES * STYLE["legend.fontsize"] * POINT)


def head_of(title: str, subtitle: str, legend: str, names: Sequence[str], room: float) -> Head:
    """Return the head for a width (inches); a legend has two names or more, and is uncut beside a title."""
    bold, small = measure(STYLE["figure.titlesize"], bold=True), measure(STYLE["legend.fontsize"])
    title = fitted(title, room, bold)
    names = names[:MOST_LABELS] if len(names) > 1 else ()
    widest = max(map(small, names), default=0.0)
    beside = room - GAP - max(measure(STYLE["font.size"])(subtitle), *map(bold, title.split("\n")))
    columns = _columns(beside, widest, len(names))
    fits = max(small(legend), columns * (BESIDE + BETWEEN + widest) - BETWEEN) <= beside
    if not names or (fits and len(names) <= 2 * columns):
        return Head(title, subtitle, legend, tuple(names), columns, is_below=False)
    each = (room + BETWEEN) / min(len(names), MOST_COLUMNS) - BESIDE - BETWEEN
    widest = min(widest, max(LONGEST_NAME, each))
    labels = tuple(fitted(name, widest, small, lines=1) for name in names)
    columns = _columns(room, widest, len(names))
    return Head(title, subtitle, fitted(legend, room, small), labels, columns, is_below=True)


def _columns(room: float, widest: float, count: int) -> int:
    """Return the number of columns of a legend with so wide labels."""
    return max(1, min(count, MOST_COLUMNS, int((room + BETWEEN) / (BESIDE + BETWEEN + widest))))


def more_lines(text: str, size: float) -> float:
    """Return the height (inches) of all lines of a text but the first."""
    return text.count("\n") * LINES * size * POINT


def draw_head(sheet: Sheet, head: Head) -> None:
    """Write the head; the legend names what the first panel has drawn."""
    width, height = sheet.get_size_inches()
    left, right = EDGE / width, 1.0 - EDGE / width
    size = STYLE["figure.titlesize"]
    sheet.text(left, 1.0 - 0.1 / height, head.title, fontsize=size, fontweight="bold", va="top")
    below_title = 0.36 + more_lines(head.title, size)
    sheet.text(left, 1.0 - below_title / height, head.subtitle, color=GREY, va="top")
    if not head.labels or not sheet.axes:
        return
    handles = sheet.axes[0].get_legend_handles_labels()[0][: len(head.labels)]
    down, edge = (head.top - 0.06, left) if head.is_below else (0.06, right)
    sheet.legend(
        handles, head.labels, title=head.legend, loc="upper left" if head.is_below else "upper right",
        ncols=head.columns, bbox_to_anchor=(edge, 1.0 - down / height),
        title_fontsize=STYLE["legend.fontsize"], alignment="left" if head.is_below else "right",
    )  # fmt: skip
