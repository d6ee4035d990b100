"""The answer of a linear system to a step: rise time, overshoot, settling time, and the curve.

They mean what python-control's `step_info` means by them: the rise from 10 % to 90 % of the end, the settling
to within 2 % of it. If the end is 0, as that of a disturbance which an integrator takes away, there is no
rise and no overshoot, and the settling is to within 2 % of the largest value.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.analysis.probe import Matrix, Vector
from quadvis.analysis.systems import library

SLOW = 1e-6  # 1/s; a pole that is slower is an integrator's
FAINT = 1e-7  # of the largest part of the answer: a smaller one is noise
DONE = 1e-4  # of the answer, or of its end if that is less: what remains when the curve ends
DENSITY = 60  # points in the time constant, or in 1/(2 pi) of the period, of the fastest part that is left
SEGMENT = 100
MOST = 400_000  # instants of a curve
LOW, HIGH, BAND = 0.1, 0.9, 0.02

Matrices = tuple[Matrix, Matrix, Matrix, Matrix]
Curve = Iterator[tuple[Vector, Vector]]


def rates_of(poles: NDArray[Any], period: float) -> NDArray[np.complex128]:
    """Return poles as rates (1/s): of a sampled system their logarithms over the period, of 0 -inf."""
    with np.errstate(divide="ignore", invalid="ignore"):  # -inf + 0j over a number
        found = np.log(poles.astype(complex)) / period if period else poles
    return np.asarray(found, np.complex128)


@dataclass(frozen=True)
class Modes:
    """The poles of a system, as rates (1/s), and how strong each is in the answer to a step.

    ``size`` is that of the answer. Those of poles that nearly coincide, such as the many at 0 of a dead time,
    are much stronger than the answer, and nearly cancel each other.
    """

    rates: NDArray[np.complex128]
    strengths: Vector
    size: float

    @staticmethod
    def of(a: Matrix, b: Vector, c: Matrix, d: Vector, period: float, gain: float) -> Modes:
        """Return the modes of x' = a x + b, y = c x + d, or of x+ = a x + b if the period is not 0.

        ``gain`` is the largest one of the system.
        """
        if not len(a):
            return Modes(np.zeros(0, complex), np.zeros(0), gain)
        poles, vectors = np.linalg.eig(a)
        driven = np.abs(np.linalg.lstsq(vectors, b.astype(complex), rcond=None)[0])
        parts = driven * np.abs(c @ vectors).max(axis=0)
        rates = rates_of(poles, period)
        slow = np.abs(rates) < SLOW
        gaps = np.where(slow, 1.0, np.abs(1.0 - poles) if period else np.abs(poles))
        strengths = parts / gaps
        size = min(float(strengths.max()), gain)
        faint = FAINT * max(size, float(np.abs(d).max()))
        return Modes(rates, np.where(strengths > faint, strengths, 0.0), size)

    @property
    def integrate(self) -> bool:
        """True if the answer to a step has a part that grows with time as an integrator's."""
        return bool(((np.abs(self.rates) < SLOW) & (self.strengths > 0.0)).any())

    @property
    def settle(self) -> bool:
        """True if all parts of the answer decay."""
        return bool((self.rates.real[self.strengths > 0.0] < -SLOW).all())

    def left(self, time: float, size: float) -> NDArray[np.complex128]:
        """Return the rates of the parts that are larger than a size at a time (s)."""
        with np.errstate(over="ignore", invalid="ignore"):
            remaining = self.strengths * np.exp(self.rates.real * time)
        return self.rates[remaining > size]


@dataclass(frozen=True)
class StepResponse:
    """The answer ``values`` at ``times`` (s) after the step, and ``final``, where it ends.

    ``sampled`` says that it stands still between these times. Both are empty if the answer does not settle,
    or takes more than 400,000 instants; then all else is NaN.
    """

    times: Vector
    values: Vector
    final: float
    sampled: bool

    @property
    def settles(self) -> bool:
        """True if there is a curve."""
        return bool(self.times.size)

    @cached_property
    def _scale(self) -> float:
        """The size of which the settling is measured."""
        return 0.0 if math.isnan(self.final) else abs(self.final)

    @property
    def rise_time(self) -> float:
        """The time (s) from 10 % to 90 % of the end; NaN if the end is 0."""
        if not self.settles or not self._scale:
            return math.nan
        reached = self.values / self.final
        return self._first(reached, HIGH) - self._first(reached, LOW)

    @property
    def overshoot(self) -> float:
        """How far the answer goes beyond its end, as a share of it; 0 if never, NaN if the end is 0."""
        if not self.settles or not self._scale:
            return math.nan
        return max(0.0, float((self.values / self.final).max()) - 1.0)

    @property
    def settling_time(self) -> float:
        """The time (s) after which the answer stays within 2 % of its end."""
        if not self.settles:
            return math.nan
        scale = self._scale or float(np.abs(self.values).max())
        outside = np.abs(self.values - (self.final if self._scale else 0.0)) - BAND * scale
        late = np.flatnonzero(outside >= 0.0)
        if not late.size:
            return float(self.times[0])
        last = int(late[-1])
        if last + 1 == self.times.size:
            return math.nan
        return self._between(outside, last + 1)

    @property
    def extreme(self) -> float:
        """The value that is farthest from 0."""
        return float(self.values[np.argmax(np.abs(self.values))]) if self.settles else math.nan

    def _first(self, values: Vector, level: float) -> float:
        """Return the first time at which values have reached a level."""
        index = int(np.argmax(values >= level))
        return self._between(values - level, index)

    def _between(self, values: Vector, index: int) -> float:
        """Return the time of the zero before a point; a sampled answer has it at the point itself."""
        if self.sampled or not index:
            return float(self.times[index])
        times = self.times[max(0, index - 2) : index + 2]
        near = values[max(0, index - 2) : index + 2]
        left, right = float(self.times[index - 1]), float(self.times[index])
        curve = np.polynomial.Polynomial.fit(times, near, len(times) - 1)
        if curve(left) * curve(right) > 0.0:
            return right
        return float(library("scipy.optimize").brentq(curve, left, right, xtol=1e-15 * right))


def step_response(
    matrices: Matrices, period: float, times: tuple[Vector, Vector], modes: Modes, final: float
) -> StepResponse:
    """Return the answer to a step of 1 at the first instant of the input, until nothing of it is left.

    The arguments are those of `quadvis.analysis.response.Response`; ``final`` is the end of the answer.
    """
    size = min(modes.size, abs(final) or math.inf) or 1.0
    if not modes.settle:
        return StepResponse(np.zeros(0), np.zeros(0), math.nan, bool(period))
    curve = (_sampled if period else _continuous)(matrices, period, times, modes, DONE * size)
    found, count = [], 0
    for part in curve:
        found.append(part)
        count += len(part[0])
        if count > MOST:
            return StepResponse(np.zeros(0), np.zeros(0), math.nan, bool(period))
    instants, values = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return StepResponse(instants, values, final, bool(period))


def _continuous(
    matrices: Matrices,
    _: float,
    __: tuple[Vector, Vector],
    modes: Modes,
    size: float,
) -> Curve:
    """Yield pieces of the curve, each in steps that suit the fastest part that is left."""
    a, b, c, d = matrices
    count = len(a)
    whole = np.zeros((count + 1, count + 1))
    whole[:count, :count], whole[:count, count:] = a, b
    state, time = np.append(np.zeros(count), 1.0), 0.0
    read = np.append(c[0], d[0, 0])
    yield np.zeros(1), np.array([float(read @ state)])
    while (left := modes.left(time, size)).size:
        step = 1.0 / (DENSITY * float(np.abs(left).max()))
        once = library("scipy.linalg").expm(whole * step)
        states = np.empty((SEGMENT, count + 1))
        for index in range(SEGMENT):
            state = once @ state
            states[index] = state
        yield time + step * np.arange(1.0, SEGMENT + 1), np.asarray(states @ read)
        time += SEGMENT * step


def _sampled(
    matrices: Matrices,
    period: float,
    times: tuple[Vector, Vector],
    modes: Modes,
    size: float,
) -> Curve:
    """Yield the outputs of each hyperperiod, at their instants after the step."""
    a, b, c, d = matrices
    held, through = b.sum(axis=1), d.sum(axis=1)
    instants = times[1] - times[0][0]
    state, number = np.zeros(len(a)), 0
    last = -1.0
    while number < 2 or last < 0.0 or modes.left(number * period, size).size:
        now = instants + number * period
        seen = now >= -1e-12
        last = float(now[-1])
        yield now[seen], (c @ state + through)[seen]
        state = a @ state + held
        number += 1
