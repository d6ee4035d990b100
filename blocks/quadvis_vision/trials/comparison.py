"""Compare methods of pose estimation: the table of figure 3 and the curves of figure 2, section 6.1."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.machine.files import PNG, Kind, reason, write_output
from quadvis.output.canvas import blank_sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

FIGURE = Kind("the figure", PNG.heads)
NAMES = ("x", "y", "z", "phi", "theta", "psi")
SCALES = np.array([100.0] * 3 + [180 / np.pi] * 3)  # from m and rad to cm and deg
UNITS = ("cm",) * 3 + ("deg",) * 3

# Okabe and Ito's colours, which colour-blind readers can distinguish.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
_FEW = 60  # up to so many pictures each one gets a mark
_NEGLIGIBLE = 1e-3  # cm or deg: smaller differences are drawn as zero
_WIDEST, _THINNEST = 4.0, 1.2  # width of lines; later lines are thinner, so that equal curves all show


@dataclass(frozen=True, eq=False)
class Poses:
    """The poses of one method in n pictures: `values` (n, 6) are x, y, z in m and roll, pitch, yaw in rad.

    `times` (n,) are in s; a row with NaN belongs to a picture without a pose.
    """

    name: str
    times: Floats
    values: Floats

    @property
    def found(self) -> NDArray[np.bool_]:
        """A mask (n,) of the pictures that have a pose."""
        return np.asarray(np.isfinite(self.values).all(axis=1))


@dataclass(frozen=True, eq=False)
class PoseDifference:
    """The first method minus the second, over the `count` pictures in which both have a pose.

    `rms` (6,) is in m and rad, angles taken the short way round; `ratios` (count,) are those of the distances
    z. Without a picture in common `rms` is NaN.
    """

    first: str
    second: str
    count: int
    rms: Floats
    ratios: Floats


def difference(first: Poses, second: Poses) -> PoseDifference:
    """Compare two methods on the same pictures; `QuadvisError` if they have different numbers of pictures."""
    if len(first.values) != len(second.values):
        counts = f"{len(first.values)} and {len(second.values)} pictures"
        raise QuadvisError(f"'{first.name}' and '{second.name}' have {counts}; give both one rate")
    both = first.found & second.found
    a, b = first.values[both], second.values[both]
    if not both.any():
        return PoseDifference(first.name, second.name, 0, np.full(6, np.nan), np.zeros(0))
    apart = a - b
    apart[:, 3:] -= 2 * np.pi * np.round(apart[:, 3:] / (2 * np.pi))
    rms = np.sqrt(np.mean(apart**2, axis=0))
    return PoseDifference(first.name, second.name, len(a), rms, a[:, 2] / b[:, 2])


def differences(methods: Sequence[Poses]) -> list[PoseDifference]:
    """Compare every method with every later one."""
    return [difference(*pair) for pair in itertools.combinations(methods, 2)]


def spread(methods: Sequence[Poses], count: int) -> list[int]:
    """Return at most `count` pictures (from 1), evenly spread over those that have a pose by every method."""
    common = np.flatnonzero(np.logical_and.reduce([method.found for method in methods]))
    if not len(common):
        return []
    places = np.linspace(0, len(common) - 1, min(count, len(common)))
    return [int(common[round(place)]) + 1 for place in places]


def table(methods: Sequence[Poses], pictures: Sequence[int]) -> str:
    """Return figure 3: the pose in each of these pictures (from 1) by every method, side by side."""
    width = 7 * len(NAMES)
    heads = "".join(f"  {method.name:^{width}}" for method in methods)
    names = "".join("  " + "".join(f"{name:>7}" for name in NAMES) for _ in methods)
    units = "".join("  " + "".join(f"{unit:>7}" for unit in UNITS) for _ in methods)
    lines = [f"{'':7}{heads}", f"picture{names}", f"{'':7}{units}"]
    for picture in pictures:
        rows = ("  " + _cells(method.values[picture - 1] * SCALES) for method in methods)
        lines.append(f"{picture:7}{''.join(rows)}")
    return "\n".join(line.rstrip() for line in lines)


def _cells(row: Floats) -> str:
    # Adding zero turns -0.0 into 0.0.
    return "".join(f"{round(number, 1) + 0.0:7.1f}" if np.isfinite(number) else f"{'-':>7}" for number in row)


def sentences(found: Sequence[PoseDifference]) -> str:
    """Return the differences in words, one line for each pair."""
    lines = []
    for pair in found:
        head = f"{pair.first} - {pair.second}"
        if not pair.count:
            lines.append(f"{head}: no picture with a pose by both")
            continue
        shown = [
            f"{name} {round(value, 6):.4g}" for name, value in zip(NAMES, pair.rms * SCALES, strict=True)
        ]
        lines.append(
            f"{head}, rms of {pair.count} pictures: {'  '.join(shown[:3])} cm   {'  '.join(shown[3:])} deg   "
            f"z ratio {pair.ratios.mean():.4f} ({pair.ratios.min():.4f} to {pair.ratios.max():.4f})"
        )
    return "\n".join(lines)


def draw(methods: Sequence[Poses], pictures: Sequence[int], path: Path) -> None:
    """Draw figure 2 as PNG: position and attitude by all methods over time, these pictures (from 1) marked.

    `QuadvisError` if the file cannot be written.
    """
    style: Any = {
        "axes.spines.right": False,
        "axes.spines.top": False,
        "font.size": 10,
        "grid.color": "#DDDDDD",
    }
    with blank_sheet(13.0, 9.0, style, layout="constrained") as sheet:
        grid = sheet.subplots(4, 3, sharex=True, height_ratios=(2, 1, 2, 1))
        for column in range(len(NAMES)):
            row = 2 * (column // 3)
            _draw_values(grid[row, column % 3], methods, pictures, column)
            _draw_differences(grid[row + 1, column % 3], methods, column)
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
        sheet.align_ylabels()
        handles, labels = grid[0, 0].get_legend_handles_labels()
        sheet.legend(handles, labels, loc="outside upper left", ncols=len(methods), frameon=False)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise QuadvisError(f"cannot write the figure '{path}': {reason(error)}") from error
        write_output(path, FIGURE, lambda file: sheet.savefig(file, format="png"))


def _draw_values(axes: Axes, methods: Sequence[Poses], pictures: Sequence[int], column: int) -> None:
    for index, method in enumerate(methods):
        _draw_curve(axes, method.times, method.values[:, column] * SCALES[column], index, len(methods))
        axes.lines[-1].set_label(method.name)
    for picture in pictures:
        time = float(methods[0].times[picture - 1])
        axes.axvline(time, color="#999999", linewidth=0.8, linestyle=(0, (2, 3)), zorder=0)
        axes.text(time, 1.0, str(picture), transform=axes.get_xaxis_transform(), color="#777777", ha="center")
    axes.set_ylabel(f"{NAMES[column]} ({UNITS[column]})")
    axes.grid(linewidth=0.6)


def _draw_differences(axes: Axes, methods: Sequence[Poses], column: int) -> None:
    """Draw the differences of the other methods from the first."""
    reach = _NEGLIGIBLE
    for index, method in enumerate(methods[1:], 1):
        apart = method.values[:, column] - methods[0].values[:, column]
        if column >= 3:
            apart = apart - 2 * np.pi * np.round(apart / (2 * np.pi))
        apart = apart * SCALES[column]
        _draw_curve(axes, method.times, apart, index, len(methods))
        reach = max(reach, 1.1 * float(np.nanmax(np.abs(apart), initial=0)))
    axes.set_ylim(-reach, reach)
    axes.set_ylabel(f"minus {methods[0].name}")
    axes.grid(linewidth=0.6)


def _draw_curve(axes: Axes, times: Floats, values: Floats, index: int, count: int) -> None:
    share = index / max(1, count - 1)
    axes.plot(
        times,
        values,
        color=_COLOURS[index % len(_COLOURS)],
        linewidth=_WIDEST - share * (_WIDEST - _THINNEST),
        marker="." if len(times) <= _FEW else "",
    )
