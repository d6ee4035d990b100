"""The texts of `quadvis sweep`: a line of progress, and at the end the spread over the runs."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, counted, quoted
from quadvis.errors.caller import as_given
from quadvis.machine.columns import table as aligned
from quadvis.machine.status_line import StatusLine
from quadvis.run.report import not_judged
from quadvis.sweeps.axes import GRID, SEED, Axis
from quadvis.sweeps.designs import DESIGNS, ONE_AT_A_TIME, SAMPLED
from quadvis.sweeps.estimates import IntervalEstimate, estimate_mean, estimate_probability, estimate_quantile
from quadvis.sweeps.table import FAILURE, PASSED, Table
from quadvis.sweeps.worker import Quantity

LOW, HIGH = 5, 95  # percentiles
QUANTILES = (5.0, 50.0, 95.0)  # %, unless others are asked for
MOST_LINES = 40
MOST_GROUPS = 10  # points of a grid with intervals
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


def read_quantiles(text: str) -> tuple[float, ...]:
    """Return percents from a text such as "5,50,95"; QuadvisError if it is something else."""
    try:
        found = tuple(float(part.strip().removesuffix("%")) for part in text.split(","))
    except ValueError:
        found = ()
    if not found or not all(0.0 <= percent <= 100.0 for percent in found):
        asked = as_given("--quantiles", "quantiles")
        raise QuadvisError(f"{quoted(text)} are no quantiles; give {asked} percents such as 5,50,95")
    return found


def sweep_lines(
    table: Table, width: int | None = None, quantiles: Sequence[float] | None = None
) -> list[str]:
    """Return the summary of a sweep as text.

    A grid has one line for each point, as many columns as fit, and the intervals of each point if
    ``quantiles`` (%) are asked for. A sample has the intervals of all runs together.
    """
    groups = table.groups()
    lines = [f"{table.name}: {counted(table.runs, 'run')}, {extent(table, len(groups))}"]
    if table.design.name == GRID:
        lines += _points(table, groups, width or WIDTH)
    if table.design.name == ONE_AT_A_TIME:
        lines += _changes(table, width or WIDTH)
    if table.design.name in SAMPLED or quantiles:
        for point, rows in groups[:MOST_GROUPS]:
            lines += _intervals(table, _point_words(table, point), rows, quantiles or QUANTILES)
        if len(groups) > MOST_GROUPS:
            lines.append(f"  and {len(groups) - MOST_GROUPS} points more")
    note = [table.note] if table.note else []
    return [*lines, *_failures(table), *not_judged(table.margins), *note, _verdict(table)]


def _points(
    table: Table, groups: Sequence[tuple[tuple[int, ...], NDArray[np.intp]]], width: int
) -> list[str]:
    others = [axis for axis in table.design.axes if axis.name != SEED]
    heads = [[*(axis.name for axis in others), "passed"]]
    for point, rows in groups[:MOST_LINES]:
        labels = [axis.label(index) for axis, index in zip(others, point, strict=True)]
        heads.append([*labels, _passed(table, rows)])
    columns = []
    for quantity in shown_quantities(table):
        values = table[quantity.column]
        columns.append([quantity.column, *(_spread(values[rows]) for _, rows in groups[:MOST_LINES])])
    lines: list[str] = []
    for chunk in _chunks(heads, columns, width):
        lines += ["", *(f"  {line}" for line in chunk)]
    if len(groups) > MOST_LINES:
        lines.append(f"  and {len(groups) - MOST_LINES} points more")
    if any(len(rows) > 1 for _, rows in groups):
        lines += ["", f"  mean ({LOW} to {HIGH} %) over the runs of a point"]
    return lines


def _changes(table: Table, width: int) -> list[str]:
    """Return a line for each run of one at a time: the value that is not the diagram's, the numbers."""
    rows = range(min(table.runs, MOST_LINES))
    passed = table[PASSED]
    heads = [["", "passed"], *([table.design.where(row), "yes" if passed[row] else "NO"] for row in rows)]
    columns = [
        [quantity.column, *(f"{value:.4g}" for value in table[quantity.column][: len(rows)])]
        for quantity in shown_quantities(table)
    ]
    lines: list[str] = []
    for chunk in _chunks(heads, columns, width):
        lines += ["", *(f"  {line}" for line in chunk)]
    return [*lines, f"  and {table.runs - MOST_LINES} runs more"] if table.runs > MOST_LINES else lines


def _point_words(table: Table, point: Sequence[int]) -> str:
    others = [axis for axis in table.design.axes if axis.name != SEED]
    pairs = zip(others, point, strict=False)
    return ", ".join(f"{axis.name}={axis.label(place)}" for axis, place in pairs)


def _intervals(table: Table, head: str, rows: NDArray[np.intp], quantiles: Sequence[float]) -> list[str]:
    """Return means and quantiles of these rows, and how probable it is that an expectation fails."""
    found = [["", "mean", "95 % of the mean", *(f"{percent:g} %" for percent in quantiles)]]
    for quantity in shown_quantities(table):
        values = table[quantity.column][rows]
        values = values[np.isfinite(values)]
        mean = estimate_mean(values)
        shares = (estimate_quantile(values, percent).value for percent in quantiles)
        found.append(
            [quantity.column, f"{mean.value:.4g}", _ends(mean), *(f"{share:.4g}" for share in shares)]
        )
    fails = [["", "fails", "probability", "95 % of it"]]
    for name, count in _failing(table, rows):
        probability = estimate_probability(count, len(rows))
        share = IntervalEstimate(*(100.0 * end for end in probability))
        fails.append([name, f"{count} of {len(rows)}", f"{share.value:.3g} %", f"{_ends(share)} %"])
    title = ["", f"  {head}"] if head else []
    return [
        *title,
        "",
        *(f"  {line}" for line in aligned(found)),
        "",
        *(f"  {line}" for line in aligned(fails)),
    ]


def _ends(found: IntervalEstimate) -> str:
    return (
        f"{found.low:.4g} to {found.high:.4g}"
        if np.isfinite((found.low, found.high)).all()
        else "too few runs"
    )


def _failing(table: Table, rows: NDArray[np.intp]) -> list[tuple[str, int]]:
    """Return how many of these runs fail each expectation, and how many fail at all."""
    found = []
    for quantity in table.quantities:
        if not quantity.summary:
            values = table[quantity.column][rows].tolist()
            found.append((quantity.label, sum(not quantity.holds(value) for value in values)))
    return [*found, ("any of them", int(np.count_nonzero(~table[PASSED][rows])))]


def extent(table: Table, points: int) -> str:
    """Return the numbers of seeds and of points of the grid, or the design, as text."""
    if table.design.name != GRID:
        return f"{DESIGNS[table.design.name]} over {', '.join(axis.name for axis in table.design.axes)}"
    grid = [axis for axis in table.design.axes if isinstance(axis, Axis)]
    seeds = next((len(axis.values) for axis in grid if axis.name == SEED), 0)
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
    found = table.reasons()
    lines = []
    for failure, (row, count) in list(found.items())[:5]:
        more = f" (and {count - 1} more)" if count > 1 else ""
        lines.append(f"  stopped: {table.design.where(int(table.rows[row]))}{more}: {failure}")
    if len(found) > 5:
        lines.append(f"  and {len(found) - 5} other reasons, in the column '{FAILURE}'")
    return lines


def _verdict(table: Table) -> str:
    count = int(np.count_nonzero(table[PASSED]))
    return f"{'PASSED' if table.passed else 'FAILED'}: {count} of {counted(table.runs, 'run')} passed"
