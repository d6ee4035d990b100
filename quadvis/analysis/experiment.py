"""Two recorded signals on one grid of times: what an identification works on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quadvis.analysis.probe import Vector
from quadvis.errors import QuadvisError, quoted
from quadvis.output.recording import Recording
from quadvis.units import Unit, UnitError

EVEN = 1e-3  # of the period: how far a sample may lie from its place
FEWEST = 8


@dataclass(frozen=True)
class Experiment:
    """An input ``u`` (N,), held from sample to sample, and an output ``y`` (N,) at the times of the grid.

    ``period`` is that of the grid (s), ``begin`` its first time (s). ``seen`` are the places at which the
    output was recorded, every ``stride``-th one; elsewhere y is NaN. ``unit`` is that of y over u.
    """

    names: tuple[str, str]
    u: Vector
    y: Vector
    period: float
    begin: float
    stride: int
    unit: Unit

    @property
    def seen(self) -> slice:
        """The places at which the output was recorded."""
        return slice(0, None, self.stride)

    @staticmethod
    def of(recording: Recording, names: tuple[str, str], after: float = 0.0) -> Experiment:
        """Take two signals from a recording, from a time on (s).

        QuadvisError if one is no single number, if their samples are not evenly spaced or do not fit
        together, if there are too few of them, or if the input stands still.
        """
        (stamps, u), (others, y) = (_signal(recording, name, after) for name in names)
        periods = [_period(name, times) for name, times in zip(names, (stamps, others), strict=True)]
        period, begin = min(periods), max(stamps[0], others[0])
        stride = round(periods[1] / period)
        if abs(stride * period - periods[1]) > EVEN * period:
            problem = f"{quoted(names[1])} has a sample each {periods[1]:g} s, {quoted(names[0])} each"
            raise QuadvisError(f"{problem} {periods[0]:g} s; one must be a whole multiple of the other")
        first = int(np.searchsorted(others, begin - EVEN * period))
        begin = float(others[first]) if first < others.size else begin
        end = min(stamps[-1] + periods[0] - period, others[-1])
        count = int((end - begin) / period + EVEN) + 1 if end >= begin else 0
        grid = begin + period * np.arange(count)
        held = np.searchsorted(stamps, grid + EVEN * period, side="right") - 1
        values = np.full(count, np.nan)
        places = first + np.arange(-(-count // stride))
        values[::stride] = y[places]
        found = Experiment(names, u[held], values, period, begin, stride, _unit(recording, names))
        found.check()
        return found

    def check(self) -> None:
        """Refuse a recording from which nothing follows."""
        inside = self.y[self.seen]
        if inside.size < FEWEST:
            raise QuadvisError(f"there are {inside.size} samples of both signals; record longer")
        if np.ptp(self.u) == 0.0:
            problem = f"the input {quoted(self.names[0])} stands still at {self.u[0]:g}"
            raise QuadvisError(f"{problem}: nothing can be identified; move it, such as by sources.prbs")


def _signal(recording: Recording, name: str, after: float) -> tuple[Vector, Vector]:
    values = np.asarray(recording[name], np.float64)
    if values.ndim != 1:
        problem = f"{quoted(name)} has {int(np.prod(values.shape[1:]))} numbers"
        raise QuadvisError(f"{problem}; choose one, such as {name}[{','.join('0' * (values.ndim - 1))}]")
    times = recording.times(name)
    late = times >= after - 1e-9
    if not late.any():
        raise QuadvisError(f"{quoted(name)} has no sample after {after:g} s")
    if not np.isfinite(values[late]).all():
        raise QuadvisError(f"{quoted(name)} holds values that are no numbers; begin later, by --after")
    return times[late], values[late]


def _period(name: str, times: Vector) -> float:
    if times.size < FEWEST:
        raise QuadvisError(f"{quoted(name)} has {times.size} samples; record longer")
    period = float((times[-1] - times[0]) / (times.size - 1))
    wrong = np.abs(times - times[0] - period * np.arange(times.size)).max()
    if wrong > max(EVEN * period, 2e-9):
        steps = np.diff(times)
        problem = (
            f"the samples of {quoted(name)} are not evenly spaced, {steps.min():g} s to {steps.max():g} s"
        )
        raise QuadvisError(f"{problem}; bring them to one rate first, as 'quadvis export --every' does")
    return period


def _unit(recording: Recording, names: tuple[str, str]) -> Unit:
    """Return the unit of the output over the input; 1 if one is not known."""
    found = []
    for name in names:
        port, index = recording.find(name)[2:]
        texts = port.unit.split()
        try:
            units = [Unit.parse(text) for text in texts]
        except UnitError:
            return Unit()
        place = int(np.arange(int(np.prod(port.shape))).reshape(port.shape)[index]) if port.shape else 0
        found.append(units[place if len(units) > 1 else 0])
    return found[1] / found[0]
