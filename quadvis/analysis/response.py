"""The response of a transfer: in frequency, and to a step.

A sampled one is lifted: it has an input and an output for each instant of a hyperperiod. Its response at a
frequency is that part of the output which has the frequency of the input, as it is measured by a sweep of
sines; for one rate it is the transfer function.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from quadvis.analysis.margins import Complexes, grid_between
from quadvis.analysis.probe import Matrix, Vector
from quadvis.analysis.steps import SLOW, Modes, StepResponse, rates_of, step_response
from quadvis.analysis.systems import instant_names, library, named_system
from quadvis.diagram.sections.transfers import Transfer
from quadvis.output.statistics import finite

HALF_POWER = 10.0 ** (-3.0 / 20.0)  # -3 dB, as python-control's bandwidth has it
FAINT = 1e-7  # of the largest gain: a smaller one at frequency 0 is noise
FLAT = 1.0 + 1e-6  # a gain that is larger only by this is no peak


@dataclass(frozen=True)
class Response:
    """The response of a transfer's target to a disturbance of its source.

    ``matrices`` are a (N, N), b (N, K), c (M, N), d (M, K), without states that are on no way; ``states`` are
    the names of the N states. With a ``period`` of 0 they are in continuous time, K = M = 1. Otherwise they
    are lifted over a hyperperiod of ``period`` (s), and ``times`` are the K and M instants in it (s).
    """

    transfer: Transfer
    matrices: tuple[Matrix, Matrix, Matrix, Matrix]
    period: float
    states: tuple[str, ...]
    times: tuple[Vector, Vector]

    @cached_property
    def system(self) -> Any:
        """The response as `control.StateSpace`; its dt is the hyperperiod, 0 in continuous time."""
        ends = (self.transfer.source.text, self.transfer.target.text)
        names = [instant_names(text, list(times)) for text, times in zip(ends, self.times, strict=True)]
        return named_system(self.matrices, self.period, self.states, names[0], names[1])

    @cached_property
    def poles(self) -> Complexes:
        """The poles of the states on the way (1/s), slowest first; those that die in a period left out."""
        rates = rates_of(np.linalg.eigvals(self.matrices[0]), self.period)
        rates = rates[rates.real * self.period > math.log(1e-4)]
        return rates[np.argsort(-rates.real, kind="stable")]

    @property
    def stable(self) -> bool:
        """True if the answer to a step settles."""
        return self.modes.settle

    @cached_property
    def modes(self) -> Modes:
        """How each pole answers a step."""
        a, b, c, d = self.matrices
        gain = float(np.abs(self.values).max())
        return Modes.of(a, b.sum(axis=1), c, d.sum(axis=1), self.period, gain)

    @property
    def top(self) -> float:
        """The largest frequency that both ends show (rad/s): half the slower rate, or no limit."""
        return math.pi * min(map(len, self.times)) / self.period if self.period else math.inf

    def at(self, omega: float) -> complex:
        """Return the response at a frequency (rad/s)."""
        a, b, c, d = self.matrices
        point = np.exp(1j * omega * self.period) if self.period else 1j * omega
        waves = [np.exp(1j * omega * times) if self.period else np.ones(1) for times in self.times]
        driven = np.linalg.solve(point * np.eye(len(a)) - a, b @ waves[0]) if len(a) else np.zeros(0)
        return complex(waves[1].conjugate() @ (c @ driven + d @ waves[0])) / len(waves[1])

    @cached_property
    def frequencies(self) -> Vector:
        """The frequencies of plots (rad/s), from far below the slowest pole to far above the fastest."""
        speeds = np.abs(self.poles)
        speeds = speeds[(speeds > 1e-3) & np.isfinite(speeds)]
        low, high = (speeds.min(), speeds.max()) if speeds.size else (1.0, 1.0)
        low, high = 0.02 * low, min(50.0 * high, self.top)
        return np.union1d(grid_between(min(low, 0.01 * high), high), speeds[speeds < high])

    @cached_property
    def values(self) -> Complexes:
        """The response at these frequencies."""
        return np.array([self.at(omega) for omega in self.frequencies.tolist()])

    @cached_property
    def dc_gain(self) -> float:
        """The gain at frequency 0, in the unit of the transfer; infinite with an integrator on the way."""
        a, b, c, d = self.matrices
        if self.modes.integrate:
            return math.inf
        gap = np.eye(len(a)) - a if self.period else -a
        held = b.sum(axis=1)
        slow = (np.abs(self.modes.rates) < SLOW).any()  # and yet without effect
        still = np.linalg.lstsq(gap, held, rcond=1e-9)[0] if slow else np.linalg.solve(gap, held)
        found = float(np.mean(c @ still + d.sum(axis=1)))
        return found if abs(found) > FAINT * np.abs(self.values).max() else 0.0

    @cached_property
    def _peak(self) -> tuple[float, float]:
        """The largest gain and its frequency (rad/s)."""
        gains, grid = np.abs(self.values), self.frequencies
        first = abs(self.dc_gain)
        best = int(np.argmax(gains))
        ends = grid[max(0, best - 1)], grid[min(len(grid) - 1, best + 1)]
        fine = library("scipy.optimize").minimize_scalar(
            lambda omega: -abs(self.at(omega)),
            bounds=ends,
            method="bounded",
            options={"xatol": 1e-9 * ends[1]},
        )
        found = max((-float(fine.fun), float(fine.x)), (float(gains[best]), float(grid[best])))
        return found if found[0] > FLAT * first else (first, 0.0)

    @property
    def peak(self) -> float:
        """The largest gain, in the unit of the transfer; infinite with an integrator on the way."""
        return self._peak[0]

    @property
    def peak_frequency(self) -> float:
        """The frequency of the largest gain (rad/s); 0 if it is the gain at frequency 0."""
        return self._peak[1]

    @property
    def resonance(self) -> float:
        """The largest gain over that at frequency 0; NaN if this is 0 or infinite."""
        first = abs(self.dc_gain)
        return self.peak / first if 0.0 < first < math.inf else math.nan

    @cached_property
    def bandwidth(self) -> float:
        """The first frequency (rad/s) at which the gain is 3 dB below that at frequency 0.

        Infinite if there is none up to `top`; NaN if the gain at frequency 0 is 0 or infinite.
        """
        first = abs(self.dc_gain)
        if not 0.0 < first < math.inf:
            return math.nan
        limit = HALF_POWER * first
        below = np.flatnonzero(np.abs(self.values) < limit)
        if not below.size:
            return math.inf
        index = int(below[0])
        start = float(self.frequencies[index - 1]) if index else 1e-6 * float(self.frequencies[0])
        return float(
            library("scipy.optimize").brentq(
                lambda omega: abs(self.at(omega)) - limit, start, float(self.frequencies[index]), rtol=1e-12
            )
        )

    def facts(self) -> dict[str, Any]:
        """Return the response as plain data, in the unit of the transfer, rad/s and s."""
        transfer, step = self.transfer, self.step
        numbers = {
            "dc_gain": self.dc_gain, "bandwidth": self.bandwidth, "peak": self.peak,
            "peak_frequency": self.peak_frequency, "resonance": self.resonance, "rise_time": step.rise_time,
            "overshoot": step.overshoot, "settling_time": step.settling_time,
        }  # fmt: skip
        return {
            "from": transfer.source.text,
            "to": transfer.target.text,
            "open": [signal.text for signal in transfer.opened],
            "unit": str(transfer.unit),
            "hyperperiod_s": self.period,
            "stable": self.stable,
            **{name: finite(value) for name, value in numbers.items()},
        }

    @cached_property
    def step(self) -> StepResponse:
        """The answer to a disturbance of 1 from time 0 on."""
        return step_response(self.matrices, self.period, self.times, self.modes, self.dc_gain)
