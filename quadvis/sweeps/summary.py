"""What `quadvis sweep` shows: a line of progress while it goes on, the spread over the seeds at the end."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quadvis.machine.status_line import StatusLine
from quadvis.output.columns import table as aligned
from quadvis.sweeps.axes import SEED
from quadvis.sweeps.table import FAILURE, PASSED, Table
from quadvis.sweeps.worker import Quantity

LOW, HIGH = 5, 95  # percentiles
MOST_LINES = 40
WIDTH = 110  # where there is no terminal


class SweepLine(StatusLine):
    """How many runs are finished, how fast they go, and how long the rest will take."""

    def __init__(self) -> None:
        super().__init__()
        self.began = time.monotonic()
        self.known: int | None = None  # runs that were there before

    def __call__(self, finished: int, count: int, failed: int) -> None:
        """Show how far the sweep is."""
        self.known = finished - 1 if self.known is None else self.known
        left = duration_text((count - finished) * (time.monotonic() - self.began) / (finished - self.known))
        words = f"  {failed} failed" if failed else ""
        self.show(f"{self.bar(finished / count)} {finished} / {count} runs{words}  {left} left")


def duration_text(seconds: float) -> str:
    """Return a time for people: 40 s, 12 min, 3.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def shown_quantities(table: Table) -> list[Quantity]:
    """Return what people look at: the numbers of the summary, or those of expectations if it has none."""
    return [quantity for quantity in table.quantities if quantity.summary] or list(table.quantities)


def sweep_lines(table: Table, width: int | None = None) -> list[str]:
    """Return the summary of a sweep, for people: a line for every point of the grid, columns as they fit."""
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
    lines = [f"{table.name}: {_counted(table.runs, 'run')}, {extent(table, len(groups))}"]
    for chunk in _chunks(heads, columns, width or WIDTH):
        lines += ["", *(f"  {line}" for line in chunk)]
    if len(groups) > MOST_LINES:
        lines.append(f"  and {len(groups) - MOST_LINES} points more")
    if any(len(rows) > 1 for _, rows in groups):
        lines += ["", f"  mean ({LOW} to {HIGH} %) over the runs of a point"]
    return [*lines, *_failures(table), _verdict(table)]


def extent(table: Table, points: int) -> str:
    """Return how many seeds and points of the grid there are, in words."""
    seeds = next((len(axis.values) for axis in table.axes if axis.name == SEED), 0)
    words = [_counted(seeds, "seed")] * bool(seeds) + [_counted(points, "point")] * (points > 1 or not seeds)
    return " at ".join(words)


def _counted(count: int, word: str) -> str:
    return f"{count} {word}{'s' * (count != 1)}"


def _passed(table: Table, rows: NDArray[np.intp]) -> str:
    return f"{np.count_nonzero(table[PASSED][rows])} of {len(rows)}"


def _spread(values: NDArray[np.float64]) -> str:
    """Return the mean and the range of what there is."""
    found = values[~np.isnan(values)]
    if not found.size:
        return "none"
    mean = f"{np.mean(found):.4g}"
    if np.isinf(found).any() or not np.ptp(found):
        return mean
    low, high = np.percentile(found, (LOW, HIGH))
    return f"{mean} ({low:.3g} to {high:.3g})"


def _chunks(heads: Sequence[list[str]], columns: Sequence[list[str]], width: int) -> list[list[str]]:
    """Return tables that are as wide as the terminal, each with the heads of the rows."""
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
    """Return why runs stopped: each reason once, with the first run that it stopped and how many more."""
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
    return f"{'PASSED' if table.passed else 'FAILED'}: {count} of {_counted(table.runs, 'run')} passed"
