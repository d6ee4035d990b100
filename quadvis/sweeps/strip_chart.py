"""Pictures of many runs: one panel for each number, with its spread at each value of the axis."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from quadvis.machine.files import PLOT, write_output
from quadvis.output.canvas import blank_sheet
from quadvis.output.style import COLOURS, ELLIPSIS, STYLE, WIDTHS, fitted, measure
from quadvis.sweeps.strip_head import EDGE, GAP, GREY, LINES, draw_head, head_of, more_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HEIGHT, BOTTOM = 2.9, 0.5  # inches: height of a row, and of the space below all rows
WIDER = 0.96  # measured over drawn width of a long text: its letters keep to whole pixels
BESIDE_AXES = 0.85  # inches beside the axes, for numbers and the gap to the neighbour
NOTE_SIZE = 8.5
MOST_NOTES = 3  # lines about what is the same in all runs
PERCENTILES = (5.0, 25.0, 75.0, 95.0)
FEW = 5  # fewer runs get no box
MOST_LABELS = 12  # labels along an axis
BETWEEN_LABELS = 0.06  # inches between the labels along an axis; if there is no room, they are turned
LEAST_LINE = 0.9  # inches; narrower labels are not broken into two lines
TURN, LONGEST_TURNED = 25.0, 1.6  # degrees and inches of a turned label
FAILED = "#C0392B"
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
NEAR = 2.0  # a limit is drawn if it is at most so many spreads away from the values
KEY = "dot: a run   cross: a run that failed   box: middle half   whiskers: 5 to 95 %   black line: mean"


@dataclass(frozen=True)
class Cloud:
    """The values of one number at one position of the axis, and whether each run passed."""

    values: NDArray[np.floating]
    passed: NDArray[np.bool_]


@dataclass(frozen=True)
class StripPanel:
    """The panel of one number: ``clouds`` by series, then by position; ``limit`` of its expectation."""

    title: str
    unit: str
    clouds: Sequence[Sequence[Cloud]]
    limit: float | None = None


@dataclass(frozen=True)
class Strips:
    """A whole picture: its panels, and the positions and series that they all share."""

    title: str
    subtitle: str
    axis: str
    places: Sequence[str]
    series: Sequence[str]
    legend: str
    panels: Sequence[StripPanel]
    note: str = ""


def draw_strips(strips: Strips, path: Path, inputs: Iterable[Path] = ()) -> None:
    """Write a PNG; QuadvisError if it cannot be written, or replaces an input or another kind of file."""
    count = len(strips.panels)
    columns = 2 if count == 4 else min(len(WIDTHS), max(1, count))
    rows = max(1, math.ceil(count / columns))
    width = WIDTHS[columns - 1]
    room = width / columns - BESIDE_AXES
    ticks = _ticks(strips.places, room)
    room = min(room, width / columns - GAP - ticks.overhang(room))
    inside = WIDER * (width - 2 * EDGE)
    head = head_of(strips.title, strips.subtitle, strips.legend, strips.series, inside)
    axis = fitted(strips.axis, room, measure(STYLE["font.size"]))
    titles = [_title(panel, room) for panel in strips.panels]
    notes = [KEY] if _has_spread(strips) else []
    notes += [fitted(strips.note, inside, measure(NOTE_SIZE), MOST_NOTES)] if strips.note else []
    note = "\n".join(notes)
    row = HEIGHT + max((more_lines(title, STYLE["axes.titlesize"]) for title in titles), default=0.0)
    bottom = BOTTOM + max(0.0, more_lines(note, NOTE_SIZE) - more_lines("\n", NOTE_SIZE))
    panels = rows * row + more_lines(axis, STYLE["font.size"])
    height = head.height + panels + bottom
    style = {**STYLE, "axes.grid.axis": "y", "axes.axisbelow": True}
    with blank_sheet(width, height, style) as sheet:
        sheet.set_layout_engine("constrained", rect=(0.0, bottom / height, 1.0, panels / height), w_pad=0.1)
        for number, (panel, title) in enumerate(zip(strips.panels, titles, strict=True), 1):
            axes = sheet.add_subplot(rows, columns, number)
            _draw_panel(axes, strips, panel, title, ticks)
            if number > count - columns:
                axes.set_xlabel(axis)
        draw_head(sheet, head)
        edge, below = EDGE / width, 0.06 / height
        sheet.text(edge, below, note, color=GREY, fontsize=NOTE_SIZE, linespacing=LINES)
        write_output(path, PLOT, lambda file: sheet.savefig(file, format="png"), inputs)


@dataclass(frozen=True)
class _Ticks:
    """The positions along the axis that have a label, and their labels, cut to fit."""

    places: range
    labels: tuple[str, ...]
    are_turned: bool

    def overhang(self, room: float) -> float:
        """Return how far (inches) turned labels reach beyond the left end of axes of about this width."""
        if not self.are_turned:
            return 0.0
        widest = max(map(measure(STYLE["font.size"]), self.labels))
        return math.cos(math.radians(TURN)) * widest - 0.4 * room / self.places.stop


def _ticks(names: Sequence[str], room: float) -> _Ticks:
    """Return the labels in one line or two, where all are whole so; turned and cut, where they are not."""
    places = range(0, len(names), math.ceil(len(names) / MOST_LABELS))
    width, each = measure(STYLE["font.size"]), room / len(places) - BETWEEN_LABELS
    lines = 2 if each >= LEAST_LINE else 1
    labels = tuple(fitted(names[place], each, width, lines) for place in places)
    if not any(ELLIPSIS in label for label in labels):
        return _Ticks(places, labels, are_turned=False)
    labels = tuple(fitted(names[place], LONGEST_TURNED, width, lines=1) for place in places)
    return _Ticks(places, labels, are_turned=True)


def _title(panel: StripPanel, room: float) -> str:
    """Return the title of a panel; its last line is empty where the expectation would not fit beside it."""
    text = f"{panel.title} [{panel.unit}]" if panel.unit else panel.title
    width = measure(STYLE["axes.titlesize"])
    title = fitted(text, room, width)
    used = width(title.rpartition("\n")[2]) + GAP + measure(NOTE_SIZE)(_expected(panel))
    return f"{title}\n" if panel.limit is not None and used > room else title


def _expected(panel: StripPanel) -> str:
    return f"expected {panel.limit:.4g} {panel.unit}".rstrip() if panel.limit is not None else ""


def _has_spread(strips: Strips) -> bool:
    return any(len(cloud.values) > 1 for panel in strips.panels for row in panel.clouds for cloud in row)


def _draw_panel(axes: Axes, strips: Strips, panel: StripPanel, title: str, ticks: _Ticks) -> None:
    count = len(strips.series)
    width = min(0.76 / count, 0.5 if len(strips.places) > 1 else 0.3)
    lonely = all(len(cloud.values) <= 1 for row in panel.clouds for cloud in row)
    for number, (row, colour) in enumerate(zip(panel.clouds, itertools.cycle(COLOURS), strict=False)):
        shift = 0.0 if lonely else (number - (count - 1) / 2) * width
        positions = np.arange(len(row)) + shift
        label = strips.series[number]
        if lonely:
            values = [cloud.values[0] if cloud.values.size else math.nan for cloud in row]
            good = [index for index, cloud in enumerate(row) if cloud.passed.all()]
            axes.plot(positions, values, "o-", color=colour, markersize=5, label=label, markevery=good)
        else:
            axes.plot([], [], "s", color=colour, label=label)
            for position, cloud in zip(positions, row, strict=True):
                _draw_cloud(axes, position, 0.86 * width, cloud, colour)
        _draw_failed(axes, positions, row, 0.0 if lonely else 0.86 * width)
    _finish(axes, strips, panel, title, ticks)


def _draw_cloud(axes: Axes, position: float, width: float, cloud: Cloud, colour: str) -> None:
    """Draw the dots of one position, over a box of their quartiles if they are enough."""
    from matplotlib.patches import Rectangle

    good = np.isfinite(cloud.values)
    values = cloud.values[good]
    if not values.size:
        return
    if values.size >= FEW:
        low, first, third, high = np.percentile(values, PERCENTILES)
        axes.plot([position, position], [low, high], color=colour, linewidth=1.2, zorder=2)
        axes.add_patch(
            Rectangle(
                (position - width / 2, first), width, third - first,
                facecolor=colour, edgecolor=colour, alpha=0.3, linewidth=1.0, zorder=2,
            )
        )  # fmt: skip
    shown = good & cloud.passed
    dots = position + _offsets(len(cloud.values), width)[shown]
    axes.plot(
        dots, cloud.values[shown], "o", color=colour, markersize=3.6, alpha=0.75, markeredgewidth=0, zorder=4
    )
    ends = [position - width / 2, position + width / 2]
    axes.plot(ends, [values.mean()] * 2, color="#222222", linewidth=1.4, solid_capstyle="butt", zorder=3)


def _draw_failed(axes: Axes, positions: NDArray[np.floating], row: Sequence[Cloud], width: float) -> None:
    for position, cloud in zip(positions, row, strict=True):
        failed = np.isfinite(cloud.values) & ~cloud.passed
        places = position + _offsets(len(cloud.values), width)[failed]
        axes.plot(
            places, cloud.values[failed], "x", color=FAILED, markersize=5.5, markeredgewidth=1.4, zorder=6
        )


def _offsets(count: int, width: float) -> NDArray[np.floating]:
    """Return the offsets of dots: evenly spread, neighbours far apart, always the same."""
    return ((np.arange(count) * GOLDEN + 0.5) % 1.0 - 0.5) * 0.8 * width


def _finish(axes: Axes, strips: Strips, panel: StripPanel, title: str, ticks: _Ticks) -> None:
    """Write labels and title, draw the limit, and leave room for all of them."""
    count = len(strips.places)
    turned, alignment = (TURN, "right") if ticks.are_turned else (0.0, "center")
    axes.set_xticks(list(ticks.places), ticks.labels, rotation=turned, ha=alignment)
    axes.tick_params(axis="x", length=0 if ticks.places.step == 1 else 3)
    axes.set_xlim(-0.6, count - 0.4)
    axes.set_title(title, loc="left")
    values = np.concatenate([cloud.values for cloud in itertools.chain(*panel.clouds)] or [np.zeros(0)])
    values = values[np.isfinite(values)]
    if not values.size:
        axes.text(0.5, 0.5, "no values", transform=axes.transAxes, ha="center", color="#777777")
        return
    for line in _limits(panel, values):
        axes.axhline(line, color=FAILED, linewidth=1.0, linestyle=(0, (5, 3)), zorder=1)
    if panel.limit is not None:
        axes.set_title(_expected(panel), loc="right", fontsize=NOTE_SIZE, color=FAILED)


def _limits(panel: StripPanel, values: NDArray[np.floating]) -> Iterator[float]:
    """Yield the limit if it is near enough to the values not to flatten their picture."""
    if panel.limit is None:
        return
    least, most = min(values.min(), 0.0), max(values.max(), 0.0)
    if abs(panel.limit - np.clip(panel.limit, values.min(), values.max())) <= NEAR * (most - least):
        yield panel.limit
