"""The picture of a sweep that is no grid: each number against each axis, a dot for a run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadvis.machine.files import PLOT, write_output
from quadvis.output.canvas import blank_sheet
from quadvis.output.style import COLOURS, STYLE, fitted, measure
from quadvis.sweeps.axes import AnyAxis
from quadvis.sweeps.designs import ONE_AT_A_TIME
from quadvis.sweeps.strip_chart import BESIDE_AXES, FAILED, NOTE_SIZE
from quadvis.sweeps.strip_head import EDGE, GREY, draw_head, head_of, more_lines
from quadvis.sweeps.table import PASSED, Table
from quadvis.sweeps.worker import Quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HEIGHT, BOTTOM = 2.2, 0.4  # inches: height of a row of panels, and of the space below all rows
PANEL, LEAST_WIDTH, MOST_WIDTH = 2.6, 8.0, 16.0  # inches: width of a panel, and of the picture
MOST_AXES, MOST_QUANTITIES = 8, 10
MOST_DRAWN = 5000  # runs
MOST_NAMES = 6  # of the values of an axis
KEY = "dot: a run   cross: a run that failed"
EXPECTED, OWN = "dashes: expected", "line: with the diagram's own values"


def draw_scatter(
    table: Table,
    quantities: Sequence[Quantity],
    subtitle: str,
    note: str,
    path: Path,
    inputs: Iterable[Path] = (),
) -> None:
    """Write a PNG; QuadvisError if it cannot be written, or replaces an input or another kind of file."""
    axes, quantities = table.design.axes[:MOST_AXES], quantities[:MOST_QUANTITIES]
    drawn = np.arange(0, table.runs, math.ceil(table.runs / MOST_DRAWN))
    places = table.design.places(table.rows[drawn])
    passed = table[PASSED][drawn]
    width = min(MOST_WIDTH, max(LEAST_WIDTH, PANEL * len(axes)))
    room = width / len(axes) - BESIDE_AXES
    if len(drawn) < table.runs:
        subtitle = f"{subtitle}; {len(drawn)} of them are drawn"
    head = head_of(table.name, subtitle, "", (), width - 2 * EDGE)
    limited = EXPECTED if any(quantity.limit is not None for quantity in quantities) else ""
    own = OWN if table.design.name == ONE_AT_A_TIME else ""
    words = fitted(
        "   ".join(filter(None, (KEY, limited, own, note))), width - 2 * EDGE, measure(NOTE_SIZE), 3
    )
    bottom = BOTTOM + more_lines(words, NOTE_SIZE)
    panels = HEIGHT * len(quantities)
    height = head.height + panels + bottom
    style = {**STYLE, "axes.axisbelow": True, "axes.xmargin": 0.04}
    with blank_sheet(width, height, style) as sheet:
        sheet.set_layout_engine("constrained", rect=(0.0, bottom / height, 1.0, panels / height), w_pad=0.08)
        grid = sheet.subplots(len(quantities), len(axes), squeeze=False, sharey="row", sharex="col")
        for row, quantity in enumerate(quantities):
            values = table[quantity.column][drawn]
            for number in range(len(axes)):
                _draw_panel(grid[row][number], places[:, number], values, passed, quantity)
            _label(grid[row][0], quantity)
        for number, axis in enumerate(axes):
            _name(grid[-1][number], axis, room)
        draw_head(sheet, head)
        sheet.text(EDGE / width, 0.06 / height, words, color=GREY, fontsize=NOTE_SIZE)
        write_output(path, PLOT, lambda file: sheet.savefig(file, format="png"), inputs)


def _draw_panel(
    axes: Axes,
    places: NDArray[np.float64],
    values: NDArray[np.float64],
    passed: NDArray[np.bool_],
    quantity: Quantity,
) -> None:
    """Draw the runs; those with the diagram's own value, as one at a time has them, are a line."""
    finite = np.isfinite(values)
    own = np.isnan(places)
    size, alpha = (5.0, 0.9) if len(values) <= 40 else (3.6, 0.6) if len(values) <= 1000 else (2.0, 0.35)
    good, bad = finite & passed & ~own, finite & ~passed & ~own
    axes.plot(
        places[good], values[good], "o", color=COLOURS[0], markersize=size, alpha=alpha, markeredgewidth=0
    )
    axes.plot(places[bad], values[bad], "x", color=FAILED, markersize=size + 1, alpha=min(1.0, alpha + 0.2))
    if own[0] and finite[0]:
        axes.axhline(values[0], color=GREY, linewidth=0.8, zorder=1)
        changed = finite & ~own
        axes.plot(places[changed], values[changed], color=COLOURS[0], linewidth=0.8, alpha=0.5)
    limit, shown = quantity.limit, values[finite]
    if (
        limit is not None
        and shown.size
        and abs(limit - np.median(shown)) <= 3 * (np.ptp(shown) or abs(limit))
    ):
        axes.axhline(limit, color=FAILED, linewidth=1.0, linestyle=(0, (5, 3)), zorder=1)


def _label(axes: Axes, quantity: Quantity) -> None:
    unit = f"\n[{quantity.unit}]" if quantity.unit else ""
    axes.set_ylabel(fitted(quantity.label, HEIGHT - 0.5, measure(STYLE["font.size"])) + unit)


def _name(axes: Axes, axis: AnyAxis, room: float) -> None:
    """Write the name of an axis, and that of each of a few values."""
    axes.set_xlabel(fitted(axis.column, room + BESIDE_AXES / 2, measure(STYLE["font.size"])))
    values: Any = getattr(axis, "values", ())
    if values and (len(values) <= MOST_NAMES or axis.cells([0.0]).dtype.kind not in "if"):
        shown = range(0, len(values), math.ceil(len(values) / MOST_NAMES))
        width = measure(STYLE["font.size"])
        labels = [fitted(axis.label(place), room / len(shown), width, lines=1) for place in shown]
        axes.set_xticks(list(shown), labels)
    elif values:
        ticks = np.unique(np.linspace(0, len(values) - 1, MOST_NAMES - 1).astype(int)).tolist()
        axes.set_xticks(ticks, [f"{axis.cells([place])[0]:g}" for place in ticks])
