"""The picture of a sweep: the first axis goes from left to right, colours distinguish the other axes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadvis.sweeps.axes import GRID, SEED, Axis
from quadvis.sweeps.scatter import draw_scatter
from quadvis.sweeps.strip_chart import Cloud, StripPanel, Strips, draw_strips
from quadvis.sweeps.summary import extent, shown_quantities
from quadvis.sweeps.table import PASSED, Table
from quadvis.sweeps.worker import Quantity

MOST_DRAWN = 20_000  # runs; of more of them each so many-th is drawn

Rows = list[list[NDArray[np.intp]]]  # by series, then by position along the first axis


def draw(table: Table, path: Path, inputs: Iterable[Path] = ()) -> None:
    """Draw the numbers of the summary; QuadvisError if the file cannot be written."""
    if table.design.name != GRID:
        shown, same = _sorted_out(table)
        draw_scatter(table, shown, _subtitle(table, 1), _note(same), path, inputs)
        return
    others = [axis for axis in table.design.axes if axis.name != SEED and isinstance(axis, Axis)]
    across = max(others, key=lambda axis: len(axis.values), default=None)
    number = others.index(across) if across else 0
    groups = table.groups()
    series: list[tuple[int, ...]] = [()]
    if across:
        series = sorted({point[:number] + point[number + 1 :] for point, _ in groups})
    rows: Rows = [[np.zeros(0, np.intp)] * (len(across.values) if across else 1) for _ in series]
    for point, found in groups:
        thinned = found[:: math.ceil(len(found) / max(1, MOST_DRAWN // len(groups)))]
        rows[series.index(point[:number] + point[number + 1 :])][point[number] if across else 0] = thinned
    shown, same = _sorted_out(table)
    rest = [axis for axis in others if axis is not across]
    draw_strips(
        Strips(
            title=table.name,
            subtitle=_subtitle(table, len(groups)),
            axis=across.column if across else "",
            places=_places(across) if across else ["all runs"],
            series=[_label(rest, point) for point in series],
            legend=", ".join(axis.name for axis in rest),
            panels=[_panel(table, quantity, rows) for quantity in shown],
            note=_note(same),
        ),
        path,
        inputs,
    )


def _note(same: Sequence[str]) -> str:
    return f"the same in all runs: {', '.join(same)}" if same else ""


def _sorted_out(table: Table) -> tuple[list[Quantity], list[str]]:
    """Return the quantities that differ between runs, and sentences about those that do not."""
    varied, same = [], []
    for quantity in shown_quantities(table):
        values = table[quantity.column]
        if len(values) > 1 and np.isfinite(values).all() and not np.ptp(values):
            same.append(f"{quantity.label} {values[0]:.4g} {quantity.unit}".rstrip())
        else:
            varied.append(quantity)
    return (varied, same) if varied else (shown_quantities(table), [])


def _places(axis: Axis) -> list[str]:
    """Return the labels along an axis; the axis's title names the unit."""
    if axis.numbers:
        return [f"{number:g}" for number in axis.numbers]
    return [axis.label(index) for index in range(len(axis.values))]


def _label(axes: Sequence[Axis], point: Sequence[int]) -> str:
    return ", ".join(axis.label(index) for axis, index in zip(axes, point, strict=True))


def _subtitle(table: Table, points: int) -> str:
    passed, stopped = (
        int(np.count_nonzero(table[PASSED])),
        sum(count for _, count in table.reasons().values()),
    )
    words = f"{extent(table, points)}: {passed} of {table.runs} runs passed"
    words = f"{words}, {stopped} stopped with an error" if stopped else words
    is_thinned = table.design.name == GRID and table.runs > MOST_DRAWN
    return f"{words}; some {MOST_DRAWN} of them are drawn" if is_thinned else words


def _panel(table: Table, quantity: Quantity, rows: Rows) -> StripPanel:
    values, passed = table[quantity.column], table[PASSED]
    clouds = [[Cloud(values[found], passed[found]) for found in places] for places in rows]
    return StripPanel(quantity.label, quantity.unit, clouds, quantity.limit)
