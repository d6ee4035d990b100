"""The plots of `quadvis analyse`: loops by Bode and Nyquist, transfers by Bode and by their steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.analysis.analyse import Analysis
from quadvis.analysis.identified import Identified
from quadvis.analysis.margins import Complexes, Loop
from quadvis.analysis.probe import Vector
from quadvis.analysis.report import degrees
from quadvis.analysis.response import Response
from quadvis.errors import QuadvisError
from quadvis.machine.files import PNG, file_name, write_output
from quadvis.output.canvas import blank_sheet
from quadvis.output.style import COLOURS, STYLE, fitted, measure, pretty

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HELP: dict[str, Any] = {"color": "#666666", "linewidth": 0.8, "linestyle": "--"}
MARK: dict[str, Any] = {"color": COLOURS[1], "linewidth": 0.8}
WIDTH, ROOM = 8.0, 7.2  # inches: of a sheet, and of the text above a plot
NEAR = 3.0  # what a Nyquist plot shows around 0
SHOWN = 1.6  # settling times that a plot of a step shows


def save_plots(analysis: Analysis, folder: Path) -> list[Path]:
    """Draw each loop as ``NAME-bode-CUT.png`` and ``NAME-nyquist-CUT.png``; return the paths.

    Each transfer is drawn as ``NAME-bode-TRANSFER.png``, and as ``NAME-step-TRANSFER.png`` if its answer to a
    step settles. QuadvisError if one of them would replace an input of the diagram, or a file that is no
    picture.
    """
    diagram = analysis.diagram
    name = file_name(*filter(None, (diagram.name, diagram.variant)))
    paths: list[Path] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for kind, label, height, draw in _plots(analysis):
            path = folder / f"{name}-{kind}-{file_name(label)}.png"
            if path in paths:  # a loop and a transfer of one name
                path = folder / f"{name}-{kind}-transfer-{file_name(label)}.png"
            paths.append(path)
            with blank_sheet(WIDTH, height, STYLE, layout="constrained") as figure:
                draw(figure)
                _save(figure, path, diagram.inputs)
    except OSError as error:
        raise QuadvisError(f"cannot write into '{folder}': {error.strerror or error}") from error
    return paths


Plot = tuple[str, str, float, Callable[["Figure"], None]]


def _plots(analysis: Analysis) -> Iterator[Plot]:
    """Yield the kind, the name and the height (inches) of each plot, and what draws it."""
    for loop in analysis.loops.values():
        yield "bode", loop.label, 6.0, partial(_loop_bode, loop)
        yield "nyquist", loop.label, 7.0, partial(_nyquist, loop)
    for label, response in analysis.transfers.items():
        yield "bode", label, 6.0, partial(_transfer_bode, response)
        if response.stable and response.step.settles:
            yield "step", label, 4.5, partial(_step, response)


def _save(figure: Figure, path: Path, inputs: Iterable[Path]) -> None:
    write_output(
        path,
        PNG,
        lambda file: figure.savefig(file, format="png", dpi=120, metadata={"Software": None}),
        inputs,
    )


def save_fit(found: Identified, path: Path, inputs: Iterable[Path] = ()) -> None:
    """Draw the recorded output of an identified system, and what the model makes of the same input.

    QuadvisError if the file would replace an input, or a file that is no picture.
    """
    times, measured, simulated = found.simulated
    with blank_sheet(WIDTH, 4.5, STYLE, layout="constrained") as figure:
        figure.suptitle(f"{found.names[0]} to {found.names[1]}")
        axes = figure.subplots()
        axes.plot(times, measured, color=COLOURS[0], label="recorded")
        axes.plot(times, simulated, color=COLOURS[1], label="model")
        if found.samples[1] >= 2:
            axes.axvline(float(times[found.samples[0]]), **HELP)
        axes.set_title(_words(f"fit {found.fit:.1f} %" + " after the line" * (found.samples[1] >= 2)))
        axes.set(xlabel="time (s)", ylabel=found.names[1])
        axes.legend(loc="upper right", frameon=True, framealpha=0.9, edgecolor="none")
        _save(figure, path, inputs)


def _words(*lines: str) -> str:
    """Return lines that fit above a plot."""
    return "\n".join(fitted(line, ROOM, measure(11.0)) for line in lines)


def _loop_bode(loop: Loop, figure: Figure) -> None:
    omega, values = loop.bode()
    angles = np.degrees(np.unwrap(np.angle(values)))
    middle = int(np.argmin(np.abs(np.log(np.abs(values) + 1e-300))))
    angles -= 360.0 * round((angles[middle] + 180.0) / 360.0)  # between -360 and 0 near the crossover
    gain, phase = _bode(figure, omega, values, angles)
    figure.suptitle(f"Loop opened at {loop.label}")
    gain.axhline(1.0, **HELP)
    phase.axhline(-180.0, **HELP)
    margins, lines = loop.margins, [", ".join(loop.signals)]
    if math.isfinite(margins.crossover):
        for axes in (gain, phase):
            axes.axvline(margins.crossover, **MARK)
        found = f"crossover {margins.crossover:.3g} rad/s, phase margin {degrees(margins.phase_lag)}"
        lines.append(f"{found}, delay margin {margins.delay:.3g} s")
    gain.set_title(_words(*lines))
    gain.set_ylabel("gain")


def _transfer_bode(response: Response, figure: Figure) -> None:
    values = response.values
    angles = np.degrees(np.unwrap(np.angle(values)))
    angles -= 360.0 * math.ceil((angles[0] - 180.5) / 360.0)  # above -180 where it begins
    gain, phase = _bode(figure, response.frequencies, values, angles)
    figure.suptitle(response.transfer.label)
    lines = [response.transfer.text]
    if math.isfinite(response.bandwidth):
        for axes in (gain, phase):
            axes.axvline(response.bandwidth, **MARK)
        gain.axhline(abs(response.dc_gain), **HELP)
        lines.append(f"bandwidth {response.bandwidth:.3g} rad/s")
    gain.set_title(_words(*lines))
    unit = pretty(response.transfer.unit)
    gain.set_ylabel(f"gain ({unit})" if unit else "gain")


def _bode(figure: Figure, omega: Vector, values: Complexes, angles: Vector) -> tuple[Axes, Axes]:
    from matplotlib.ticker import MultipleLocator

    gain, phase = figure.subplots(2, 1, sharex=True)
    gain.loglog(omega, np.abs(values), color=COLOURS[0])
    phase.semilogx(omega, angles, color=COLOURS[0])
    for axis in (gain.yaxis, phase.xaxis):
        axis.set_major_formatter(lambda value, _: f"{value:g}")
    phase.yaxis.set_major_locator(MultipleLocator(45.0 if np.ptp(angles) < 400.0 else 90.0))
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (rad/s)")
    figure.align_ylabels()
    return gain, phase


def _nyquist(loop: Loop, figure: Figure) -> None:
    figure.suptitle(f"Loop opened at {loop.label}")
    axes = figure.subplots()
    _, loci = loop.loci
    for locus in loci.T:
        near = np.where(np.abs(locus) < 10.0 * NEAR, locus, np.nan)
        axes.plot(near.real, near.imag, color=COLOURS[0])
        axes.plot(near.real, -near.imag, color=COLOURS[0], linewidth=0.6, alpha=0.6)
    turn = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, 361))
    axes.plot(turn.real, turn.imag, **HELP)
    axes.plot([-1.0], [0.0], "+", color=COLOURS[1], markersize=10.0, markeredgewidth=1.5)
    lines, peaks = [", ".join(loop.signals)], loop.peaks
    if math.isfinite(peaks.sensitivity) and not loop.idle:
        circle = -1.0 + turn / peaks.sensitivity
        axes.plot(circle.real, circle.imag, **MARK)
        lines.append(f"least distance from -1: {1.0 / peaks.sensitivity:.3g}, Ms {peaks.sensitivity:.3g}")
    axes.set_title(_words(*lines))
    axes.set(xlim=(-NEAR, NEAR), ylim=(-NEAR, NEAR), aspect="equal", xlabel="real", ylabel="imaginary")


def _step(response: Response, figure: Figure) -> None:
    figure.suptitle(response.transfer.label)
    axes, step = figure.subplots(), response.step
    axes.plot(
        step.times, step.values, color=COLOURS[0], drawstyle="steps-post" if step.sampled else "default"
    )
    axes.axhline(step.final, **HELP)
    facts = []
    if not math.isnan(step.rise_time):
        facts += [f"rise time {step.rise_time:.3g} s", f"overshoot {100.0 * step.overshoot:.3g} %"]
    if not math.isnan(step.settling_time):
        axes.axvline(step.settling_time, **MARK)
        facts.append(f"settling time {step.settling_time:.3g} s")
        end = min(SHOWN * step.settling_time, float(step.times[-1]))
        axes.set_xlim(0.0, end if end > 0.0 else float(step.times[-1]))
    axes.set_title(_words(response.transfer.text, ", ".join(facts)))
    unit = pretty(response.transfer.unit)
    axes.set_ylabel(f"response ({unit})" if unit else "response")
    axes.set_xlabel("time after the step (s)")
