"""The text that `quadvis analyse` prints, and its Bode plots."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from quadvis.analysis.analyse import Analysis
from quadvis.analysis.margins import Loop
from quadvis.analysis.verdict import LoopVerdict
from quadvis.errors import QuadvisError, counted
from quadvis.machine.columns import table
from quadvis.machine.files import PNG, file_name, write_output
from quadvis.output.canvas import blank_sheet
from quadvis.output.style import COLOURS, STYLE
from quadvis.units import Unit, format_quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SECOND = Unit.parse("s")
SHOWN = 8  # poles in the table
REAL = 1e-3
HEADS = ("loop opened at", "crossover", "phase margin", "delay margin", "gain margin")


def analysis_lines(analysis: Analysis) -> Iterator[str]:
    """Yield the lines of the report one by one, because limits take some time."""
    diagram = analysis.diagram
    variant = f" ({diagram.variant})" if diagram.variant else ""
    count = len(analysis.linear.states)
    way = f"lifted over {format_quantity(analysis.period, SECOND)}" if analysis.period else "continuous"
    yield f"{diagram.name}{variant}: {count} states, {way}"
    yield from part_lines(analysis.linear.parts)
    rows, more = _poles(analysis)
    yield from _indented([("closed loop poles", "frequency", "damping"), *rows])
    if more:
        yield f"and {more} faster"
    if analysis.loops:
        yield from _indented([HEADS, *map(_row, analysis.loops.values())])
    elif not analysis.limits:
        yield "No loop was opened: name signals with --cut, or under 'analyse: {cuts: ...}'."
    width = max(map(len, analysis.limits), default=0)
    for label, found in analysis.limits.items():
        yield f"  {label.ljust(width)}  {found.text}"
    yield from _indented([_verdict_row(verdict) for verdict in analysis.verdicts])
    if analysis.stable:
        yield "STABLE"
    else:
        worst = float(analysis.poles.real.max())
        yield f"NOT STABLE: a disturbance grows by {worst:.3g} 1/s, in {_growing_states(analysis)}"
    count, missed = len(analysis.verdicts), sum(not verdict.met for verdict in analysis.verdicts)
    if missed:
        yield f"FAILED: {missed} of {counted(count, 'margin')} not met"
    elif count:
        yield f"PASSED: {count} of {counted(count, 'margin')} met"


def part_lines(parts: Mapping[str, bool]) -> Iterator[str]:
    """Yield what is assumed of parts that do not always run."""
    for runs, words in ((True, "runs"), (False, "stands still, its states are frozen")):
        for name in (name for name, found in parts.items() if found == runs):
            yield f"part '{name}' {words}, as at the operating point"


def _indented(rows: list[tuple[str, ...]]) -> Iterator[str]:
    for line in table(rows):
        yield f"  {line}"


def _poles(analysis: Analysis) -> tuple[list[tuple[str, ...]], int]:
    """Return rows for the slowest poles, one row for a pair, and the number of further poles.

    The value of a multiple pole is known to 1e-3 only.
    """
    upper = [pole for pole in analysis.poles.tolist() if pole.imag >= -REAL * abs(pole)]
    rows: list[tuple[str, ...]] = []
    for pole in upper[:SHOWN]:
        imaginary = f" +- {pole.imag:.4g}j" if pole.imag > REAL * abs(pole) else ""
        damping = -pole.real / abs(pole) if abs(pole) else 0.0
        rows.append((f"{pole.real:.4g}{imaginary}", f"{abs(pole):.4g} rad/s", f"{damping:.3f}"))
    return rows, max(0, len(upper) - SHOWN)


def _growing_states(analysis: Analysis) -> str:
    """Return the names of the states that the fastest growing mode moves most."""
    values, vectors = np.linalg.eig(analysis.linear.a)
    worst = int(np.argmax(np.abs(values) if analysis.period else values.real))
    order = np.argsort(-np.abs(vectors[:, worst]), kind="stable")[:3]
    return ", ".join(analysis.linear.states[index] for index in order)


def _row(loop: Loop) -> tuple[str, ...]:
    margins = loop.margins
    if math.isnan(margins.gain_up):
        return loop.label, "", "not stable", "", ""
    lead = f", lead {_degrees(margins.phase_lead)}" if margins.phase_lead < math.pi else ""
    down = f"x {margins.gain_down:.4g}" if margins.gain_down else "no lower"
    up = f"x {margins.gain_up:.4g}" if math.isfinite(margins.gain_up) else "no upper"
    if math.isnan(margins.crossover):
        return loop.label, "none", "any", "any", f"{down}, {up}"
    return (
        loop.label,
        f"{margins.crossover:.4g} rad/s",
        f"{_degrees(margins.phase_lag)}{lead}",
        f"{margins.delay:.4g} s",
        f"{down}, {up}",
    )


def _verdict_row(verdict: LoopVerdict) -> tuple[str, ...]:
    return "met" if verdict.met else "NOT MET", str(verdict.requirement), verdict.shown


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f} deg"


def save_bode_plots(analysis: Analysis, folder: Path) -> list[Path]:
    """Draw the response of each opened loop as ``NAME-bode-CUT.png``; return the paths.

    QuadvisError if one of them would replace an input of the diagram, or a file that is no picture.
    """
    diagram = analysis.diagram
    name = file_name(*filter(None, (diagram.name, diagram.variant)))
    paths = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for loop in analysis.loops.values():
            with blank_sheet(8.0, 6.0, STYLE, layout="constrained") as figure:
                figure.suptitle(f"Loop opened at {loop.label}")
                gain, phase = figure.subplots(2, 1, sharex=True)
                _draw(loop, gain, phase)
                figure.align_ylabels()
                paths.append(folder / f"{name}-bode-{file_name(loop.label)}.png")
                _save(figure, paths[-1], diagram.inputs)
    except OSError as error:
        raise QuadvisError(f"cannot write into '{folder}': {error.strerror or error}") from error
    return paths


def _save(figure: Figure, path: Path, inputs: Iterable[Path]) -> None:
    write_output(
        path,
        PNG,
        lambda file: figure.savefig(file, format="png", dpi=120, metadata={"Software": None}),
        inputs,
    )


def _draw(loop: Loop, gain: Axes, phase: Axes) -> None:
    from matplotlib.ticker import MultipleLocator

    omega, values = loop.bode()
    angles = np.degrees(np.unwrap(np.angle(values)))
    middle = int(np.argmin(np.abs(np.log(np.abs(values) + 1e-300))))
    angles -= 360.0 * round((angles[middle] + 180.0) / 360.0)  # between -360 and 0 near the crossover
    gain.loglog(omega, np.abs(values), color=COLOURS[0])
    phase.semilogx(omega, angles, color=COLOURS[0])
    gain.axhline(1.0, color="#666666", linewidth=0.8, linestyle="--")
    phase.axhline(-180.0, color="#666666", linewidth=0.8, linestyle="--")
    margins, words = loop.margins, ", ".join(loop.signals)
    if math.isfinite(margins.crossover):
        for axes in (gain, phase):
            axes.axvline(margins.crossover, color=COLOURS[1], linewidth=0.8)
        found = f"crossover {margins.crossover:.3g} rad/s, phase margin {_degrees(margins.phase_lag)}"
        words += f"\n{found}, delay margin {margins.delay:.3g} s"
    gain.set_title(words)
    for axis in (gain.yaxis, phase.xaxis):
        axis.set_major_formatter(lambda value, _: f"{value:g}")
    phase.yaxis.set_major_locator(MultipleLocator(45.0 if np.ptp(angles) < 400.0 else 90.0))
    gain.set_ylabel("gain")
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (rad/s)")
