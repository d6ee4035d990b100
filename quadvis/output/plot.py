"""Pictures of runs as files: figures are laid out in rows of panels and drawn by matplotlib.

Sampled signals are drawn as stairs, since they stand still between their ticks; those of the continuous rate
as lines.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.files import PDF, PNG, SVG, reason, write_output
from quadvis.output.canvas import blank_sheet
from quadvis.output.figures import Figure, block_figures
from quadvis.output.overlay import Drawn, RunOverlay, short_names
from quadvis.output.panel import draw_panel, legend_of
from quadvis.output.recording import Recorded
from quadvis.output.style import STYLE, WIDTHS, fitted, measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

    from quadvis.output.log_reader import Log

HEIGHT = 3.6  # inches of a row
TITLE = 0.5  # inches for the title of a picture; each further line needs half of it
LONGEST_NAME = 200  # bytes of a file's name without its number and suffix
SIDE = 0.5  # inches that stay free beside a title
KINDS = {".png": PNG, ".svg": SVG, ".pdf": PDF}  # of files that hold figures, by suffix
UNDATED = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}  # equal figures, equal files


def plot_logs(logs: Sequence[Log], figures: Sequence[Figure], output: Path | None = None) -> list[Path]:
    """Draw figures of logs, or one for each block if none are given; return the files.

    Several logs are drawn over each other, two also with their difference. ``output`` is a file whose suffix
    is one of `KINDS`, or a folder for PNG files; it is a folder beside the first log if it is not given.
    QuadvisError if a log lacks signals, or if a file cannot hold all figures.
    """
    names = short_names([log.path for log in logs])
    folder = output or logs[0].path.with_name("-".join(dict.fromkeys(names)).replace("/", "-") + "-figures")
    overlay = RunOverlay(list(zip(names, logs, strict=True)))
    return draw_figures(overlay, figures or block_figures(logs[0]), folder, [log.path for log in logs])


def plot_times(log: Log, output: Path | None = None) -> list[Path]:
    """Draw the times of the tasks in a real-time run, a figure for each task; return the PNG files.

    They are in ``output`` or in a folder beside the log. QuadvisError if the log has none.
    """
    if not log.task_times.names:
        raise QuadvisError(f"the log '{log.path}' has no times of tasks; only a real-time run has them")
    folder = output or log.path.with_name(f"{log.path.stem}-times")
    return plot_figures(log.task_times, block_figures(log.task_times), folder, [log.path])


def plot_figures(
    recorded: Recorded, figures: Iterable[Figure], output: Path, inputs: Sequence[Path] = ()
) -> list[Path]:
    """Draw every figure of one recording, as `draw_figures` does."""
    return draw_figures(RunOverlay([("", recorded)]), figures, output, inputs)


def draw_figures(
    overlay: RunOverlay, figures: Iterable[Figure], output: Path, inputs: Sequence[Path] = ()
) -> list[Path]:
    """Draw every figure into the file ``output``, or into this folder, as ``<number>-<title>.png``.

    Before anything is drawn, QuadvisError names all signals that do not exist or do not fit their panel.
    Files that are `inputs`, or that are no pictures, are not replaced.
    """
    found = _found(overlay, figures)
    if output.suffix in KINDS:
        _write_file(found, output, inputs)
        return [output]
    digits = len(str(len(found)))
    paths = []
    try:
        output.mkdir(parents=True, exist_ok=True)
        for number, (figure, panels) in enumerate(found, 1):
            paths.append(output / f"{number:0{digits}}-{_file_name(figure.title)}.png")
            _write_file([(figure, panels)], paths[-1], inputs)
    except OSError as error:
        raise QuadvisError(f"cannot write figures to '{output}': {reason(error)}") from error
    return paths


def _found(overlay: RunOverlay, figures: Iterable[Figure]) -> list[tuple[Figure, list[Drawn]]]:
    """Return the figures with the curves of their panels; QuadvisError has all that is wrong."""
    found: list[tuple[Figure, list[Drawn]]] = []
    problems: list[str] = []
    for figure in figures:
        found.append((figure, []))
        if not figure.panels:
            problems.append(f"figure {quoted(figure.title)} has no panels; give it signals")
        for panel in figure.panels:
            try:
                found[-1][1].extend(overlay.drawn(figure, panel))
            except QuadvisError as error:
                problems.append(f"figure {quoted(figure.title)}: {error}")
    if problems:
        raise QuadvisError("\n".join(problems))
    return found


def _write_file(found: list[tuple[Figure, list[Drawn]]], path: Path, inputs: Sequence[Path]) -> None:
    """Write figures into one file, which holds one picture unless it is a PDF."""
    kind, form = KINDS[path.suffix], path.suffix[1:]
    if len(found) > 1 and kind is not PDF:
        remedy = "give a .pdf, or a folder, or choose by --signals"
        raise QuadvisError(f"'{path}' holds one figure, and there are {len(found)}; {remedy}")

    def save(file: BinaryIO) -> None:
        if kind is PDF:
            from matplotlib.backends.backend_pdf import PdfPages

            with PdfPages(file, metadata=UNDATED[path.suffix]) as pages:
                for figure, panels in found:
                    _draw(figure, panels, pages.savefig)
            return
        for figure, panels in found:
            _draw(
                figure, panels, lambda sheet: sheet.savefig(file, format=form, metadata=UNDATED[path.suffix])
            )

    write_output(path, kind, save, inputs)


def _file_name(title: str) -> str:
    name = re.sub(r"\W+", "-", title.lower()).strip("-")[:60]
    try:
        os.fsencode(name)
    except UnicodeError:  # the names of the system cannot hold these letters
        name = re.sub(r"[^a-z0-9_]+", "-", name).strip("-")
    while len(os.fsencode(name)) > LONGEST_NAME:
        name = name[:-1]
    return name or "figure"


def _draw(figure: Figure, panels: Sequence[Drawn], save: Callable[[Sheet], object]) -> None:
    """Draw a figure on a sheet, and save that."""
    paired = len(panels) == 2 * len(figure.panels)  # each with its difference
    columns = 2 if paired else min(len(WIDTHS), len(panels))
    width = WIDTHS[columns - 1]
    legends = [legend_of(panel.title, curves, panel.reference, width / columns) for panel, curves in panels]
    title = fitted(figure.title, width - SIDE, measure(STYLE["figure.titlesize"], bold=True), lines=3)
    # The highest legend of a row decides the height of the row, so that all axes have the same height.
    rows = [legends[start : start + columns] for start in range(0, len(legends), columns)]
    heights = [HEIGHT + max(legend.height for legend in row) for row in rows]
    height = TITLE * (1.0 + 0.5 * title.count("\n")) + sum(heights)
    with blank_sheet(width, height, STYLE, layout="constrained") as sheet:
        sheet.suptitle(title)
        grid = sheet.add_gridspec(len(rows), columns, height_ratios=heights)
        for number, ((panel, curves), legend) in enumerate(zip(panels, legends, strict=True)):
            axes = sheet.add_subplot(grid[divmod(number, columns)])
            draw_panel(axes, curves, panel.reference, (figure.start, figure.stop), legend)
        save(sheet)
