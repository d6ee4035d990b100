"""The loop opened at a cut point: its frequency response and its margins.

A cut may hold several signals, and a lifted loop has several instants in one hyperperiod. All of them are
scaled, turned or delayed together, so the margins are those of the eigenvalues of the loop's transfer matrix,
the characteristic loci of MacFarlane and Postlethwaite (1977). For one signal at one rate the eigenvalue is
the loop's transfer function itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.analysis.linearise import Linear
from quadvis.analysis.probe import Matrix
from quadvis.analysis.systems import library, state_space

Complexes = NDArray[np.complex128]
DENSITY = 120  # frequencies in a decade
FAINT = 1e-4  # a locus below this gain is never critical: its gain margin is above 1e4
VISIBLE = 1e-3
BEYOND = 1e-6  # how far outside of the band a sensitivity is that of its end
PRECISION = 1e-11


@dataclass(frozen=True)
class Margins:
    """The distance of the loop from instability at one cut point, and its crossover of gain 1.

    Gains are factors, infinite (up) or 0 (down) if unlimited. ``phase_lag`` and ``phase_lead`` (rad) may be
    subtracted from the phase and added to it; the smaller one is the phase margin of the textbooks. ``delay``
    is in s. These three are infinite if the gain is never 1. ``crossover`` (rad/s) is the frequency of the
    phase lag, NaN if no lag is found. All are NaN for an unstable loop.
    """

    gain_up: float = math.nan
    gain_down: float = math.nan
    phase_lag: float = math.nan
    phase_lead: float = math.nan
    delay: float = math.nan
    crossover: float = math.nan


@dataclass(frozen=True)
class SensitivityPeaks:
    """The largest sensitivity S = 1 / (1 + L) and complementary sensitivity T = L / (1 + L) of a loop.

    Textbooks call them Ms and Mt. L are the loci, so 1 / Ms is their least distance from -1. NaN for an
    unstable loop.
    """

    sensitivity: float = math.nan
    complementary: float = math.nan


@dataclass(frozen=True)
class Loop:
    """The loop opened at a cut: from the signal that its readers get (w) to the returning one (y), as -y / w.

    The sign is that of negative feedback, as for `control.margin`.
    """

    label: str
    signals: tuple[str, ...]
    closed: Linear  # with the channels of this cut only
    stable: bool

    @cached_property
    def system(self) -> Any:
        """The loop as `control.StateSpace`: one input and output for each signal and instant of the cut."""
        closed = self.closed
        inverse = np.linalg.inv(np.eye(len(closed.channels)) + closed.d)
        back = inverse @ closed.c
        a, b = closed.a - closed.b @ back, closed.b @ inverse
        return state_space(closed, a, b, -back, -inverse @ closed.d)

    @cached_property
    def margins(self) -> Margins:
        """The margins at this cut."""
        if not self.stable:
            return Margins()
        return _margins([*self._crossings(), *self._ends()])

    @cached_property
    def peaks(self) -> SensitivityPeaks:
        """The peaks of the sensitivities at this cut."""
        if not self.stable:
            return SensitivityPeaks()
        grid, loci = self.loci
        with np.errstate(all="ignore"):  # where the loop's gain is infinite its sensitivity is 0
            sensitivity = np.nan_to_num(1.0 / (1.0 + loci), posinf=0.0, neginf=0.0)
        return SensitivityPeaks(
            self._greatest(grid, np.abs(sensitivity), 1.0),
            self._greatest(grid, np.abs(1.0 - sensitivity), 0.0),
        )

    def _greatest(self, grid: NDArray[np.float64], sizes: NDArray[np.float64], added: float) -> float:
        """Return the largest size of the closed loop's loci with a number added, near the grid's largest."""

        def size(omega: float) -> float:
            return float(np.abs(added + np.linalg.eigvals(self._response(omega))).max())

        best = int(np.argmax(sizes.max(axis=1)))
        found = library("scipy.optimize").minimize_scalar(
            lambda omega: -size(omega),
            bounds=(grid[max(0, best - 1)], grid[min(len(grid) - 1, best + 1)]),
            method="bounded",
        )
        ends = [size(BEYOND * grid[0])] + ([] if self.closed.period else [size(grid[-1] / BEYOND)])
        return max(float(sizes.max()), -float(found.fun), *ends)

    @cached_property
    def idle(self) -> tuple[str, ...]:
        """The signals of the cut through which no loop passes: of a change of one, nothing comes back to it.

        Each is judged with all others as they are; a signal that is read at some of its instants only is on
        the loop.
        """
        channels = self.closed.channels
        instants: dict[int, list[int]] = {}
        for index, channel in enumerate(channels):
            instants.setdefault(channel.read, []).append(index)
        responses = [self._response(omega) for omega in self._grid().tolist()]
        idle = [
            channels[mine[0]].text
            for mine in instants.values()
            if all(np.abs(_opened(each[np.ix_(mine, mine)])).max() < FAINT for each in responses)
        ]
        return tuple(dict.fromkeys(idle))

    @cached_property
    def loci(self) -> tuple[NDArray[np.float64], Complexes]:
        """Frequencies (N,) and eigenvalues (N, loci) of the loop, each locus in a column; rad/s."""
        grid = self._grid()
        rows = [self._values(omega) for omega in grid]
        for index in range(1, len(rows)):
            rows[index] = rows[index][_matched(rows[index - 1], rows[index])]
        return grid, np.array(rows).reshape(len(grid), -1)

    def bode(self) -> tuple[NDArray[np.float64], Complexes]:
        """Return frequencies (rad/s) and the loop's response there, where larger loci do not hide it."""
        found: dict[float, complex] = {}
        for omega in self._grid().tolist():
            for value, true in self._unfolded(omega):
                if abs(value) > max(VISIBLE, abs(found.get(true, 0.0))):
                    found[true] = value
        order = sorted(found)
        return np.array(order), np.array([found[true] for true in order])

    def _grid(self) -> NDArray[np.float64]:
        """Return frequencies around those of the closed loop's poles, up to the middle of the lifted band."""
        speeds = np.abs(rates(self.closed))
        speeds = speeds[(speeds > 1e-3) & np.isfinite(speeds)]
        low, high = (speeds.min(), speeds.max()) if speeds.size else (1.0, 1.0)
        low, high = 0.02 * low, 50.0 * high
        if self.closed.period:
            high = math.pi / self.closed.period
            low = min(low, 0.01 * high)
        return grid_between(low, high)

    def _response(self, omega: float) -> Complexes:
        """Return the response (y) of the closed loop to a disturbance (d)."""
        closed = self.closed
        point = np.exp(1j * omega * closed.period) if closed.period else 1j * omega
        inner = point * np.eye(len(closed.a)) - closed.a
        return np.asarray(closed.c @ np.linalg.solve(inner, closed.b.astype(complex)) + closed.d)

    def _values(self, omega: float) -> Complexes:
        """Return the open loop's eigenvalues."""
        return _opened(self._response(omega))

    def _unfolded(self, omega: float) -> list[tuple[complex, float]]:
        """Return the eigenvalues with their true frequencies; lifting folds these into the lowest band.

        Each eigenvector is a wave over the instants of the hyperperiod and so shows the true frequency.
        """
        if self._instants == 1:
            return [(value, omega) for value in self._values(omega).tolist()]
        values, vectors = np.linalg.eig(self._response(omega))
        channels, period = self.closed.channels, self.closed.period
        turns = np.arange(-(self._instants // 2), self._instants // 2 + 1)
        true = omega + 2 * math.pi * turns / period
        waves = np.exp(-1j * np.outer(true, [channel.time for channel in channels]))
        strength = np.zeros((len(turns), len(values)))
        for read in {channel.read for channel in channels}:
            mine = [index for index, channel in enumerate(channels) if channel.read == read]
            strength += np.abs(waves[:, mine] @ vectors[mine]) ** 2
        with np.errstate(all="ignore"):
            opened = (-values / (1.0 + values)).tolist()
        found = zip(opened, true[strength.argmax(axis=0)].tolist(), strict=True)
        return [(value, at) if at >= 0.0 else (value.conjugate(), -at) for value, at in found]

    @property
    def _instants(self) -> int:
        return len({channel.time for channel in self.closed.channels})

    def _located(self, omega: float, value: complex) -> tuple[complex, float]:
        """Return an eigenvalue with its true frequency."""
        found = self._unfolded(omega)
        return min(found, key=lambda one: min(abs(one[0] - value), abs(one[0].conjugate() - value)))

    def _crossings(self) -> Iterator[tuple[str, float, complex]]:
        """Yield each crossing of gain 1 or of the negative real axis: its kind, true frequency and value."""
        grid, loci = self.loci
        for column in loci.T.tolist():
            for (left, before), (right, after) in pairwise(zip(grid.tolist(), column, strict=True)):
                if max(abs(before), abs(after)) < FAINT:
                    continue
                if (abs(before) - 1.0) * (abs(after) - 1.0) < 0.0:
                    omega, value = self._refined(left, before, right, after, _log_gain)
                    located, true = self._located(omega, value)
                    yield "gain", true, located
                if before.imag * after.imag < 0.0 and (before.real < 0.0 or after.real < 0.0):
                    omega, value = self._refined(left, before, right, after, _imaginary)
                    if value.real < 0.0 and abs(value.imag) < 1e-3 * abs(value.real):
                        yield "phase", omega, value

    def _ends(self) -> Iterator[tuple[str, float, complex]]:
        """Yield the negative real values at the ends of the band, where the loci turn back."""
        for omega in (0.0, math.pi / self.closed.period) if self.closed.period else (0.0,):
            for value in self._values(omega).tolist():
                if -1.0 / FAINT < value.real < -FAINT and abs(value.imag) < 1e-6 * abs(value.real):
                    yield "phase", omega, value

    def _refined(
        self, left: float, before: complex, right: float, after: complex, measure: Any
    ) -> tuple[float, complex]:
        """Return the frequency and value between two points at which a measure of the locus is zero."""
        while right - left > PRECISION * right:
            middle = 0.5 * (left + right)
            if not left < middle < right:
                break
            values = self._values(middle)
            value = complex(values[int(np.argmin(np.abs(values - 0.5 * (before + after))))])
            if measure(value) * measure(before) > 0.0:
                left, before = middle, value
            else:
                right, after = middle, value
        return 0.5 * (left + right), 0.5 * (before + after)


def grid_between(low: float, high: float) -> NDArray[np.float64]:
    """Return frequencies that are evenly spaced by their logarithms."""
    return np.geomspace(low, high, max(50, int(DENSITY * math.log10(high / low))))


def _opened(response: Complexes) -> Complexes:
    """Return the open loop's eigenvalues, computed from those of the closed loop, which stay finite."""
    values = np.linalg.eigvals(response)
    with np.errstate(all="ignore"):  # at a pole the gain is infinite
        return np.asarray(-values / (1.0 + values))


def _log_gain(value: complex) -> float:
    return math.log(abs(value)) if value else -math.inf


def _imaginary(value: complex) -> float:
    return value.imag


def _matched(before: Complexes, after: Complexes) -> NDArray[np.intp]:
    """Return the order of the later eigenvalues that continues each locus."""
    if len(before) == 1:
        return np.zeros(1, np.intp)
    size = np.abs(before)[:, None] + np.abs(after)[None, :] + FAINT
    cost = np.abs(before[:, None] - after[None, :]) / size
    return np.asarray(library("scipy.optimize").linear_sum_assignment(cost)[1], np.intp)


def _margins(crossings: list[tuple[str, float, complex]]) -> Margins:
    factors = [-1.0 / value.real for kind, _, value in crossings if kind == "phase"]
    turn = 2 * math.pi
    gains = [(omega, float(np.angle(-value)) % turn) for kind, omega, value in crossings if kind == "gain"]
    crossover, lag = min(gains, key=lambda gain: gain[1], default=(math.nan, math.inf))
    return Margins(
        gain_up=min((factor for factor in factors if factor > 1.0), default=math.inf),
        gain_down=max((factor for factor in factors if factor < 1.0), default=0.0),
        phase_lag=lag,
        phase_lead=min((turn - angle for _, angle in gains), default=math.inf),
        delay=min((angle / omega for omega, angle in gains if omega), default=math.inf),
        crossover=crossover,
    )


def rates(linear: Linear) -> Complexes:
    """Return the closed loop's poles (1/s); for a lifted loop the logarithms divided by the period.

    Poles that decay within one hyperperiod of a lifted loop are left out.
    """
    values = np.linalg.eigvals(linear.a).astype(complex) if linear.a.size else np.zeros(0, complex)
    if linear.period:
        values = np.log(values[np.abs(values) > 1e-4]) / linear.period
    return np.asarray(values[np.argsort(-values.real, kind="stable")])


def growth(linear: Linear) -> float:
    """Return the fastest growth of a disturbance (1/s); negative if the loop is stable."""
    found: Matrix = rates(linear).real
    return float(found.max()) if found.size else -math.inf
