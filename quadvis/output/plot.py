"""Pictures of a run as PNG files: figures are laid out in rows of panels and drawn by matplotlib.

Sampled signals are drawn as stairs, since they stand still between their ticks; those of the continuous rate
as lines.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.files import PNG, write_output
from quadvis.output.canvas import blank_sheet
from quadvis.output.curves import Curve, panel_curves
from quadvis.output.figures import Figure, block_figures
from quadvis.output.panel import draw_panel, legend_of
from quadvis.output.recording import Recorded
from quadvis.output.style import STYLE, WIDTHS, fitted, measure

if TYPE_CHECKING:
    from quadvis.output.log_reader import Log

HEIGHT = 3.6  # inches of a row
TITLE = 0.5  # inches for the title of a picture; each further line needs half of it
LONGEST_NAME = 200  # bytes of a file's name without its number and suffix
SIDE = 0.5  # inches that stay free beside a title


def plot_log(log: Log, figures: Sequence[Figure], output: Path | None = None) -> list[Path]:
    """Draw figures of a log, or one for each block if none are given; return the PNG files.

    They are in ``output`` or in a folder beside the log. QuadvisError if the log lacks signals.
    """
    folder = output or log.path.with_name(f"{log.path.stem}-figures")
    return plot_figures(log, figures or block_figures(log), folder, [log.path])


def plot_times(log: Log, output: Path | None = None) -> list[Path]:
    """Draw the times of the tasks in a real-time run, a figure for each task; return the PNG files.

    They are in ``output`` or in a folder beside the log. QuadvisError if the log has none.
    """
    if not log.task_times.names:
        raise QuadvisError(f"the log '{log.path}' has no times of tasks; only a real-time run has them")
    folder = output or log.path.with_name(f"{log.path.stem}-times")
    return plot_figures(log.task_times, block_figures(log.task_times), folder, [log.path])


def plot_figures(
    recorded: Recorded, figures: Iterable[Figure], folder: Path, inputs: Sequence[Path] = ()
) -> list[Path]:
    """Draw every figure as `<number>-<title>.png` in `folder` and return the files.

    Before anything is drawn, QuadvisError names all signals that do not exist or do not fit their panel.
    Files that are `inputs`, or that are no pictures, are not replaced.
    """
    found: list[tuple[Figure, list[list[Curve]]]] = []
    problems: list[str] = []
    for figure in figures:
        found.append((figure, []))
        if not figure.panels:
            problems.append(f"figure {quoted(figure.title)} has no panels; give it signals")
        for panel in figure.panels:
            try:
                found[-1][1].append(panel_curves(recorded, figure, panel))
            except QuadvisError as error:
                problems.append(f"figure {quoted(figure.title)}: {error}")
    if problems:
        raise QuadvisError("\n".join(problems))
    digits = len(str(len(found)))
    paths = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for number, (figure, curves) in enumerate(found, 1):
            paths.append(folder / f"{number:0{digits}}-{_file_name(figure.title)}.png")
            _draw(figure, curves, paths[-1], inputs)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise QuadvisError(f"cannot write figures to '{folder}': {reason}") from error
    return paths


def _file_name(title: str) -> str:
    name = re.sub(r"\W+", "-", title.lower()).strip("-")[:60]
    try:
        os.fsencode(name)
    except UnicodeError:  # the names of the system cannot hold these letters
        name = re.sub(r"[^a-z0-9_]+", "-", name).strip("-")
    while len(os.fsencode(name)) > LONGEST_NAME:
        name = name[:-1]
    return name or "figure"


def _draw(figure: Figure, panels: list[list[Curve]], path: Path, inputs: Sequence[Path]) -> None:
    columns = min(len(WIDTHS), len(panels))
    width = WIDTHS[columns - 1]
    pairs = list(zip(figure.panels, panels, strict=True))
    legends = [legend_of(panel.title, curves, panel.reference, width / columns) for panel, curves in pairs]
    title = fitted(figure.title, width - SIDE, measure(STYLE["figure.titlesize"], bold=True), lines=3)
    # The highest legend of a row decides the height of the row, so that all axes have the same height.
    rows = [legends[start : start + columns] for start in range(0, len(legends), columns)]
    heights = [HEIGHT + max(legend.height for legend in row) for row in rows]
    height = TITLE * (1.0 + 0.5 * title.count("\n")) + sum(heights)
    with blank_sheet(width, height, STYLE, layout="constrained") as sheet:
        sheet.suptitle(title)
        grid = sheet.add_gridspec(len(rows), columns, height_ratios=heights)
        for number, ((panel, curves), legend) in enumerate(zip(pairs, legends, strict=True)):
            axes = sheet.add_subplot(grid[divmod(number, columns)])
            draw_panel(axes, curves, panel.reference, (figure.start, figure.stop), legend)
        write_output(path, PNG, lambda file: sheet.savefig(file, format="png"), inputs)
