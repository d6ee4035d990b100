"""The picture of a package as text: curves in braille, one pair of axes for each unit, or numbers."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from quadvis.machine.columns import table
from quadvis.scopes.axes import TextAxis, exact_axis, round_axis
from quadvis.scopes.braille import HIGH, STYLES, WIDE, DotGrid
from quadvis.scopes.package import Package
from quadvis.scopes.properties import NUMERICAL
from quadvis.scopes.settings import ScopeSettings

COLOURS = (36, 33, 35, 32, 34, 31)  # of ANSI terminals; yellow and cyan are read well on dark and on light
PIECES = ("━━━━", "╍╍╍╍", "····", "━·━·")  # of the line styles, in a legend
LINES_A_MARK = 2  # lines between the numbers of a vertical axis, at least
COLUMNS_A_MARK = 14  # columns between those of the time
LEAST_WIDTH, LEAST_HEIGHT, LEAST_ROWS = 40, 8, 4
PLAIN = ScopeSettings()


class Curves(NamedTuple):
    """The traces of one unit: their columns in a package, and their vertical axis."""

    unit: str
    columns: tuple[int, ...]
    axis: TextAxis

    @property
    def labels(self) -> list[str]:
        """The texts at the round numbers of the axis; the last one, at the top, has the unit."""
        texts = [self.axis.text(mark) for mark in self.axis.marks]
        unit = f" {self.unit}" if _unit(self.unit) else ""
        return [text + (unit if text is texts[-1] else " " * len(unit)) for text in texts]


def panel(
    package: Package,
    width: int = 80,
    height: int = 20,
    settings: ScopeSettings = PLAIN,
    colours: bool = False,
) -> str:
    """Return a package as text of ``height`` lines at most and ``width`` columns at most.

    Traces of one unit share a pair of axes. With ``colours`` (ANSI; `status_line.shows_colours` says where)
    traces differ by colour, otherwise by their lines. ``settings`` give Mode, YLimit and Grid. If there is
    no room for all pairs of axes, a table of numbers takes their place. Widths and heights below 40 and 8
    count as these.
    """
    width, height = max(width, LEAST_WIDTH), max(height, LEAST_HEIGHT)
    units = dict.fromkeys(package.units)
    legends = {unit: _legend(package, unit, width, colours) for unit in units}
    rows = (height - 2 - sum(map(len, legends.values()))) // max(1, len(units))  # two lines are for the time
    if settings.Mode == NUMERICAL or rows < LEAST_ROWS or not len(package):
        return "\n".join(_numbers(package)[:height])
    groups = [_curves(package, unit, settings, (rows - 1) // LINES_A_MARK) for unit in units]
    margin = max(len(text) for group in groups for text in group.labels)
    inside = width - margin - 1
    times = exact_axis(float(package.times[0]), float(package.times[-1]), inside // COLUMNS_A_MARK)
    lines = []
    for group in groups:
        lines += legends[group.unit]
        lines += _plot(package, group, times, DotGrid(inside, rows), margin, settings.Grid, colours)
    return "\n".join(line.rstrip() for line in [*lines, *_time_axis(package, times, margin, inside)])


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _columns(package: Package, unit: str) -> tuple[int, ...]:
    return tuple(column for column, each in enumerate(package.units) if each == unit)


def _curves(package: Package, unit: str, settings: ScopeSettings, most: int) -> Curves:
    """Return the traces of a unit with an axis for all their values."""
    columns = _columns(package, unit)
    if settings.YLimit is not None:
        return Curves(unit, columns, exact_axis(*settings.YLimit, most))
    values = package.samples[:, columns]
    values = values[np.isfinite(values)]
    ends = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    return Curves(unit, columns, round_axis(*ends, most))


def _plot(
    package: Package,
    group: Curves,
    times: TextAxis,
    dots: DotGrid,
    margin: int,
    grid: bool,
    colours: bool,
) -> list[str]:
    """Return the lines of a pair of axes: numbers, axis and curves."""
    axis = group.axis
    x = (package.times - times.least) / (times.greatest - times.least) * dots.right
    for number, column in enumerate(group.columns):
        y = (axis.greatest - package.samples[:, column]) / (axis.greatest - axis.least) * dots.bottom
        dots.draw(x, y, column, STYLES[0] if colours else STYLES[number % len(STYLES)])
    labels = {
        round((1.0 - axis.place(mark)) * dots.bottom) // HIGH: text
        for mark, text in zip(axis.marks, group.labels, strict=True)
    }
    upright = {round(times.place(mark) * dots.right) // WIDE for mark in times.marks} if grid else set()
    lines = []
    for row in range(dots.height):
        behind = ["┊" if column in upright else " " for column in range(dots.width)]
        if grid and row in labels:
            behind = ["┈"] * dots.width
        edge = "┤" if row in labels else "│"
        lines.append(f"{labels.get(row, ''):>{margin}}{edge}{_cells(dots.line(row), behind, colours)}")
    return lines


def _cells(cells: Sequence[tuple[str, int]], behind: Sequence[str], colours: bool) -> str:
    """Return a line of a plot: dots, or what lies behind them; neighbours of one colour together."""
    shown = [(text or back, owner) for (text, owner), back in zip(cells, behind, strict=True)]
    runs = groupby(shown, key=lambda cell: cell[1])
    texts = ((owner, "".join(text for text, _ in run)) for owner, run in runs)
    return "".join(_coloured(text, owner) if colours and owner >= 0 else text for owner, text in texts)


def _coloured(text: str, trace: int) -> str:
    return f"\x1b[{COLOURS[trace % len(COLOURS)]}m{text}\x1b[0m"


def _time_axis(package: Package, times: TextAxis, margin: int, inside: int) -> list[str]:
    """Return the axis of the time with the trigger (▲), and its numbers."""

    def column_of(time: float) -> int:
        return round(times.place(time) * (inside * WIDE - 1)) // WIDE

    places = {column_of(mark): times.text(mark) for mark in times.marks}
    axis = ["┬" if column in places else "─" for column in range(inside)]
    if package.trigger is not None and 0 <= package.trigger < len(package):
        axis[column_of(float(package.times[package.trigger]))] = "▲"
    numbers = [" "] * (margin + 1 + inside)
    free = 0
    for place, text in places.items():
        start = min(max(margin + 1 + place - len(text) // 2, 0), len(numbers) - len(text) - 2)
        if start >= free:
            numbers[start : start + len(text)] = text
            free = start + len(text) + 1
    numbers[-1] = "s"
    return [f"{'':{margin}}└{''.join(axis)}", "".join(numbers)]


def _legend(package: Package, unit: str, width: int, colours: bool) -> list[str]:
    """Return the names of the traces of a unit, each with a piece of its line."""
    entries = []
    for number, column in enumerate(_columns(package, unit)):
        name = package.names[column]
        line = _coloured(PIECES[0], column) if colours else PIECES[number % len(PIECES)]
        entries.append((f"{line} {name}", len(PIECES[0]) + 1 + len(name)))
    return _filled(entries, width)


def _filled(entries: Sequence[tuple[str, int]], width: int) -> list[str]:
    """Return texts with their widths on shown columns in as few lines as they need."""
    lines: list[str] = []
    room = 0
    for text, wide in entries:
        if lines and wide + 3 <= room:
            lines[-1] += f"   {text}"
            room -= wide + 3
        else:
            lines.append(text)
            room = width - wide
    return lines


def _numbers(package: Package) -> list[str]:
    """Return a table: the newest value of each trace, and the least and greatest in the package."""
    time = f"{package.times[-1]:.6g}" if len(package) else ""
    rows: list[tuple[str, ...]] = [("t", time, "s", "least", "greatest")]
    for column, (name, unit) in enumerate(zip(package.names, package.units, strict=True)):
        values = package.samples[:, column]
        known = values[np.isfinite(values)]
        ends = (known.min(), known.max()) if known.size else (np.nan, np.nan)
        newest = f"{values[-1]:.6g}" if len(values) else ""
        rows.append((name, newest, _unit(unit), *(f"{end:.6g}" for end in ends)))
    widest = max(len(row[1]) for row in rows)
    return table([(row[0], row[1].rjust(widest), *row[2:]) for row in rows])
