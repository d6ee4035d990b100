"""The texts of `quadvis sweep`: a line of progress, and at the end the spread over the seeds."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import counted
from quadvis.machine.columns import table as aligned
from quadvis.machine.status_line import StatusLine
from quadvis.run.report import not_judged
from quadvis.sweeps.axes import SEED
from quadvis.sweeps.table import FAILURE, PASSED, Table
from quadvis.sweeps.worker import Quantity

LOW, HIGH = 5, 95  # percentiles
MOST_LINES = 40
WIDTH = 110  # characters, without a terminal


class SweepLine(StatusLine):
    """A status line: the number of finished runs, their speed, and the time for the others."""

    def __init__(self) -> None:
        super().__init__()
        self.began = time.monotonic()
        self.known: int | None = None  # runs that were finished before

    def __call__(self, finished: int, count: int, failed: int) -> None:
        """Show the progress of the sweep."""
        self.known = finished - 1 if self.known is None else self.known
        left = duration_text((count - finished) * (time.monotonic() - self.began) / (finished - self.known))
        words = f"  {failed} failed" if failed else ""
        self.show(f"{self.bar(finished / count)} {finished} / {count} runs{words}  {left} left")


def duration_text(seconds: float) -> str:
    """Return a time as a short text: 40 s, 12 min, 3.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def shown_quantities(table: Table) -> list[Quantity]:
    """Return the numbers to show: those of the summary or, if it has none, of the expectations."""
    return [quantity for quantity in table.quantities if quantity.summary] or list(table.quantities)


def sweep_lines(table: Table, width: int | None = None) -> list[str]:
    """Return the summary of a sweep as text: one line for each point of the grid, as many columns as fit."""
    groups = table.groups()
    others = [axis for axis in table.axes if axis.name != SEED]
    heads = [[*(axis.name for axis in others), "passed"]]
    for point, rows in groups[:MOST_LINES]:
        labels = [axis.label(index) for axis, index in zip(others, point, strict=True)]
        heads.append([*labels, _passed(table, rows)])
    columns = [
        [quantity.column, *(_spread(table[quantity.column][rows]) for _, rows in groups[:MOST_LINES])]
        for quantity in shown_quantities(table)
    ]
    lines = [f"{table.name}: {counted(table.runs, 'run')}, {extent(table, len(groups))}"]
    for chunk in _chunks(heads, columns, width or WIDTH):
        lines += ["", *(f"  {line}" for line in chunk)]
    if len(groups) > MOST_LINES:
        lines.append(f"  and {len(groups) - MOST_LINES} points more")
    if any(len(rows) > 1 for _, rows in groups):
        lines += ["", f"  mean ({LOW} to {HIGH} %) over the runs of a point"]
    return [*lines, *_failures(table), *not_judged(table.margins), _verdict(table)]


def extent(table: Table, points: int) -> str:
    """Return the numbers of seeds and of points of the grid as text."""
    seeds = next((len(axis.values) for axis in table.axes if axis.name == SEED), 0)
    if not seeds:
        return counted(points, "point")
    if points <= 1:
        return counted(seeds, "seed")
    return f"{counted(seeds, 'seed')} at {counted(points, 'point')}"


def _passed(table: Table, rows: NDArray[np.intp]) -> str:
    return f"{np.count_nonzero(table[PASSED][rows])} of {len(rows)}"


def _spread(values: NDArray[np.float64]) -> str:
    """Return the mean and the range of the values that are not NaN as text."""
    found = values[~np.isnan(values)]
    if not found.size:
        return "none"
    mean = f"{np.mean(found):.4g}"
    if np.isinf(found).any() or not np.ptp(found):
        return mean
    low, high = np.percentile(found, (LOW, HIGH))
    return f"{mean} ({low:.3g} to {high:.3g})"


def _chunks(heads: Sequence[list[str]], columns: Sequence[list[str]], width: int) -> list[list[str]]:
    """Return tables as wide as the terminal, each with the heads of the rows."""
    chunks: list[list[str]] = []
    rest = list(columns)
    while rest or not chunks:
        count = max(len(rest), 1)
        while True:
            rows = [[*head, *(column[row] for column in rest[:count])] for row, head in enumerate(heads)]
            lines = aligned(rows)
            if count <= 1 or max(map(len, lines)) + 2 <= width:
                break
            count -= 1
        chunks.append(lines)
        rest = rest[count:]
    return chunks


def _failures(table: Table) -> list[str]:
    """Return why runs stopped: each reason once, with the first such run and the number of further ones."""
    found: dict[str, list[int]] = {}
    for row, failure in enumerate(table[FAILURE].tolist()):
        if failure:
            found.setdefault(failure, []).append(row)
    lines = []
    for failure, rows in list(found.items())[:5]:
        point = zip(table.axes, table.indices[rows[0]].tolist(), strict=True)
        where = ", ".join(f"{axis.name}={axis.label(index)}" for axis, index in point)
        more = f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""
        lines.append(f"  stopped: {where}{more}: {failure}")
    if len(found) > 5:
        lines.append(f"  and {len(found) - 5} other reasons, in the column '{FAILURE}'")
    return lines


def _verdict(table: Table) -> str:
    count = int(np.count_nonzero(table[PASSED]))
    return f"{'PASSED' if table.passed else 'FAILED'}: {count} of {counted(table.runs, 'run')} passed"
