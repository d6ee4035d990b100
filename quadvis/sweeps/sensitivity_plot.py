"""The picture of sensitivities: for each number bars of how much of its spread is due to each axis."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.machine.files import PLOT, write_output
from quadvis.output.canvas import blank_sheet
from quadvis.output.style import COLOURS, STYLE, WIDTHS, fitted, measure
from quadvis.sweeps.sensitivity import Indices, sensitivities
from quadvis.sweeps.strip_chart import NOTE_SIZE
from quadvis.sweeps.strip_head import EDGE, GREY, draw_head, head_of
from quadvis.sweeps.summary import extent
from quadvis.sweeps.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAR, ABOVE, BOTTOM = 0.42, 1.0, 0.35  # inches: height of an axis's bars, of what is around them, of the note
MARGIN = 0.02  # of the variance, beside the bars
NAMES = 1.6  # inches for the names of the axes
FIRST, TOTAL = "by itself (first order)", "with others (total)"
KEY = "share of the variance, 1 in all; lines: 95 % intervals"


def draw_sensitivity(table: Table, path: Path, inputs: Iterable[Path] = ()) -> None:
    """Write a PNG; QuadvisError if no number differs between the runs, or the file cannot be written."""
    found = sensitivities(table)
    if not found:
        raise QuadvisError("no number of the summary differs between enough runs; draw no sensitivity")
    names = [axis.name for axis in table.design.axes]
    columns = min(len(WIDTHS), len(found))
    rows = math.ceil(len(found) / columns)
    width = WIDTHS[columns - 1]
    labels = [FIRST, TOTAL] if found[0].total is not None else [FIRST]
    subtitle = f"{extent(table, 1)}: sensitivities from {found[0].runs} runs"
    head = head_of(table.name, subtitle, "", labels, width - 2 * EDGE)
    panels = rows * (ABOVE + BAR * len(names))
    height = head.height + panels + BOTTOM
    style = {**STYLE, "axes.grid.axis": "x", "axes.axisbelow": True}
    with blank_sheet(width, height, style) as sheet:
        rect = (0.0, BOTTOM / height, 1.0, panels / height)
        sheet.set_layout_engine("constrained", rect=rect, w_pad=0.1)
        for number, each in enumerate(found, 1):
            axes = sheet.add_subplot(rows, columns, number)
            _draw_panel(axes, each, names, (width - NAMES) / columns)
        draw_head(sheet, head)
        words = KEY if found[0].total is not None else f"{KEY}; shares with others need --design saltelli"
        sheet.text(EDGE / width, 0.06 / height, words, color=GREY, fontsize=NOTE_SIZE)
        write_output(path, PLOT, lambda file: sheet.savefig(file, format="png"), inputs)


def _draw_panel(axes: Axes, found: Indices, names: list[str], room: float) -> None:
    places = np.arange(len(names), dtype=float)
    bars = [(FIRST, found.first, found.first_width)]
    if found.total is not None and found.total_width is not None:
        bars.append((TOTAL, found.total, found.total_width))
    size = 0.72 / len(bars)
    for number, (label, values, widths) in enumerate(bars):
        shifted = places + (number - (len(bars) - 1) / 2) * size
        axes.barh(shifted, values, size * 0.92, color=COLOURS[number], label=label, zorder=2)
        axes.errorbar(values, shifted, xerr=widths, fmt="none", ecolor="#222222", elinewidth=1.0, zorder=3)
    width = measure(STYLE["font.size"])
    axes.set_yticks(places.tolist(), [fitted(name, NAMES, width, lines=1) for name in names])
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.axvline(0.0, color="#666666", linewidth=0.8, zorder=2)
    axes.set_xlim(min(0.0, axes.get_xlim()[0] - MARGIN), max(1.0, axes.get_xlim()[1] + MARGIN))
    axes.set_title(fitted(found.quantity.label, room, measure(STYLE["axes.titlesize"])), loc="left")
