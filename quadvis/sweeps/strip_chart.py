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
from quadvis.output.style import COLOURS, STYLE, WIDTHS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

HEIGHT, TOP, BOTTOM = 2.9, 0.7, 0.5  # inches: height of a row, and of the spaces above and below all rows
MARGIN = 0.012  # of the picture's width
PERCENTILES = (5.0, 25.0, 75.0, 95.0)
FEW = 5  # fewer runs get no box
MOST_LABELS = 12  # labels along an axis
LONGEST_LABEL = 64  # characters of all labels of an axis; longer ones are turned
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
    height = TOP + HEIGHT * rows + BOTTOM
    style = {**STYLE, "axes.grid.axis": "y", "axes.axisbelow": True}
    with blank_sheet(WIDTHS[columns - 1], height, style) as sheet:
        inside = (0.0, BOTTOM / height, 1.0, HEIGHT * rows / height)
        sheet.set_layout_engine("constrained", rect=inside, w_pad=0.1)
        for number, panel in enumerate(strips.panels, 1):
            axes = sheet.add_subplot(rows, columns, number)
            _draw_panel(axes, strips, panel)
            if number > count - columns:
                axes.set_xlabel(strips.axis)
        _frame(sheet, strips, height)
        write_output(path, PLOT, lambda file: sheet.savefig(file, format="png"), inputs)


def _frame(sheet: Sheet, strips: Strips, height: float) -> None:
    """Write title, legend and key around the panels."""
    sheet.text(MARGIN, 1.0 - 0.1 / height, strips.title, fontsize=13, fontweight="bold", va="top")
    sheet.text(MARGIN, 1.0 - 0.36 / height, strips.subtitle, color="#555555", va="top")
    spread = any(len(cloud.values) > 1 for panel in strips.panels for row in panel.clouds for cloud in row)
    notes = "\n".join(filter(None, (KEY if spread else "", strips.note)))
    sheet.text(MARGIN, 0.06 / height, notes, color="#555555", fontsize=8.5, linespacing=1.5)
    if len(strips.series) > 1 and sheet.axes:
        named = list(zip(*sheet.axes[0].get_legend_handles_labels(), strict=True))[:MOST_LABELS]
        sheet.legend(
            *zip(*named, strict=True), title=strips.legend, loc="upper right", ncols=min(len(named), 6),
            bbox_to_anchor=(1.0 - MARGIN, 1.0 - 0.06 / height), title_fontsize=9, alignment="right",
        )  # fmt: skip


def _draw_panel(axes: Axes, strips: Strips, panel: StripPanel) -> None:
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
    _finish(axes, strips, panel)


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


def _finish(axes: Axes, strips: Strips, panel: StripPanel) -> None:
    """Write labels and title, draw the limit, and leave room for all of them."""
    count = len(strips.places)
    step = math.ceil(count / MOST_LABELS)
    shown = range(0, count, step)
    labels = [strips.places[index] for index in shown]
    turned = sum(map(len, labels)) > LONGEST_LABEL
    axes.set_xticks(list(shown), labels, rotation=25 if turned else 0, ha="right" if turned else "center")
    axes.tick_params(axis="x", length=0 if step == 1 else 3)
    axes.set_xlim(-0.6, count - 0.4)
    axes.set_title(f"{panel.title} [{panel.unit}]" if panel.unit else panel.title, loc="left")
    values = np.concatenate([cloud.values for cloud in itertools.chain(*panel.clouds)] or [np.zeros(0)])
    values = values[np.isfinite(values)]
    if not values.size:
        axes.text(0.5, 0.5, "no values", transform=axes.transAxes, ha="center", color="#777777")
        return
    for line in _limits(panel, values):
        axes.axhline(line, color=FAILED, linewidth=1.0, linestyle=(0, (5, 3)), zorder=1)
    if panel.limit is not None:
        words = f"expected {panel.limit:.4g} {panel.unit}".rstrip()
        axes.set_title(words, loc="right", fontsize=8.5, color=FAILED)


def _limits(panel: StripPanel, values: NDArray[np.floating]) -> Iterator[float]:
    """Yield the limit if it is near enough to the values not to flatten their picture."""
    if panel.limit is None:
        return
    least, most = min(values.min(), 0.0), max(values.max(), 0.0)
    if abs(panel.limit - np.clip(panel.limit, values.min(), values.max())) <= NEAR * (most - least):
        yield panel.limit
