"""The text that `quadvis analyse` prints."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from quadvis.analysis.analyse import Analysis
from quadvis.analysis.margins import Loop
from quadvis.analysis.response import Response
from quadvis.analysis.verdict import LoopVerdict
from quadvis.errors import counted
from quadvis.machine.columns import table
from quadvis.units import Unit, format_quantity

SECOND = Unit.parse("s")
SHOWN = 8  # poles in the table
REAL = 1e-3
HEADS = ("loop opened at", "crossover", "phase margin", "delay margin", "gain margin", "Ms", "Mt")
WAYS = (
    "transfer", "gain at 0", "bandwidth", "largest gain", "rise time", "overshoot", "settling time",
)  # fmt: skip


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
    elif not analysis.limits and not analysis.transfers:
        yield "No loop was opened: name signals with --cut, or under 'analyse: {cuts: ...}'."
    if analysis.transfers:
        yield from _indented([WAYS, *map(_way, analysis.transfers.values())])
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
        yield f"FAILED: {missed} of {counted(count, 'requirement')} on loops not met"
    elif count:
        yield f"PASSED: {count} of {counted(count, 'requirement')} on loops met"


def part_lines(parts: Mapping[str, bool]) -> Iterator[str]:
    """Yield what is assumed of parts and blocks that do not always run."""
    for runs, words in ((True, "runs"), (False, "stands still, its states are frozen")):
        for name in (name for name, found in parts.items() if found == runs):
            yield f"'{name}' {words}, as at the operating point"


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
        return loop.label, "", "not stable", "", "", "", ""
    lead = f", lead {degrees(margins.phase_lead)}" if margins.phase_lead < math.pi else ""
    down = f"x {margins.gain_down:.4g}" if margins.gain_down else "no lower"
    peaks = f"{loop.peaks.sensitivity:.4g}", f"{loop.peaks.complementary:.4g}"
    up = f"x {margins.gain_up:.4g}" if math.isfinite(margins.gain_up) else "no upper"
    if math.isnan(margins.crossover):
        return loop.label, "none", "any", "any", f"{down}, {up}", *peaks
    return (
        loop.label,
        f"{margins.crossover:.4g} rad/s",
        f"{degrees(margins.phase_lag)}{lead}",
        f"{margins.delay:.4g} s",
        f"{down}, {up}",
        *peaks,
    )


def _way(response: Response) -> tuple[str, ...]:
    step, unit = response.step, response.transfer.unit
    gains = tuple(_gain(gain, unit) for gain in (response.dc_gain, response.peak))
    at = f" at {_frequency(response.peak_frequency)}" if response.peak_frequency else ""
    row = (response.transfer.label, gains[0], _frequency(response.bandwidth), gains[1] + at)
    if not response.stable:
        return *row, "", "does not settle", ""
    share = "none" if math.isnan(step.overshoot) else f"{100.0 * step.overshoot:.3g} %"
    return *row, _time(step.rise_time), share, _time(step.settling_time)


def _gain(gain: float, unit: Unit) -> str:
    number = "unlimited" if math.isinf(gain) else f"{gain:.4g}"
    return f"{number} {unit}" if unit.symbols and math.isfinite(gain) else number


def _frequency(omega: float) -> str:
    if math.isnan(omega):
        return "none"
    return "unlimited" if math.isinf(omega) else f"{omega:.4g} rad/s"


def _time(time: float) -> str:
    return "none" if math.isnan(time) else f"{time:.4g} s"


def _verdict_row(verdict: LoopVerdict) -> tuple[str, ...]:
    return "met" if verdict.met else "NOT MET", str(verdict.requirement), verdict.shown


def degrees(angle: float) -> str:
    """Return an angle (rad) as text."""
    return f"{math.degrees(angle):.1f} deg"
