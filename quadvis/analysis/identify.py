"""`quadvis identify`: a transfer function from a recording of its input and its output.

The model is one of output errors: ``y = G u + c + e``, with noise e on the output alone. Its parameters make
the squared error of the simulated output smallest. Of these the denominator is sought by
`scipy.optimize.least_squares`; numerator, offset c and the state at the start follow from it by linear least
squares in each step (variable projection). The search starts from denominators of ARX models, fitted by
linear least squares and improved by the iteration of Steiglitz and McBride, at several rates.

Sources: L. Ljung, System Identification, sections 4.2 and 7.4; K. Steiglitz, L. E. McBride (1965);
G. H. Golub, V. Pereyra (1973).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from quadvis.analysis.experiment import Experiment
from quadvis.analysis.identified import MOST_DELAYS, Identified
from quadvis.analysis.probe import Matrix, Vector
from quadvis.analysis.progress import announce
from quadvis.analysis.systems import library
from quadvis.errors import QuadvisError, counted, quoted
from quadvis.output.recording import Recording

VALIDATION = 1.0 / 3.0  # of the recording: the share at its end that judges the model
ROUNDS = 8  # of Steiglitz and McBride
SLOWEST = 64  # times slower than the output: the slowest rate of an ARX model
STARTS = 3  # from which the search goes on
VAGUE = 1e-9  # the ratio of singular values below which a coefficient is not determined
HUGE = 1e12  # an output in place of one that overflows


class Ran(Protocol):
    """What has run and has its signals, such as the result of a run."""

    @property
    def signals(self) -> Recording:
        """The recorded signals."""


@dataclass(frozen=True)
class ModelForm:
    """What is sought: denominator of ``order``, numerator with ``zeros``, continuous or in z."""

    order: int
    zeros: int
    discrete: bool

    @property
    def count(self) -> int:
        """The number of coefficients, the offset and the initial state included."""
        return self.order + self.zeros + 1 + 1 + self.order


def identify(
    recording: Recording | Ran | str | Path,
    *,
    input: str,
    output: str,
    order: int,
    zeros: int | None = None,
    delay: bool = False,
    discrete: bool = False,
    after: float = 0.0,
    validation: float = VALIDATION,
) -> Identified:
    """Return the transfer function between two signals of a recording, a run's result, or a file.

    ``order`` is the number of its poles, ``zeros`` that of its zeros, at most as many (default: one less). It
    is continuous, with an input that is held between its samples, or ``discrete``. With ``delay`` a dead time
    of whole samples is sought, too. Samples before ``after`` (s) are left out; the last share ``validation``
    of them is not fitted, and judges the model. QuadvisError if the recording does not determine it.
    """
    form = ModelForm(order, order - 1 if zeros is None else zeros, discrete)
    if order < 1 or not 0 <= form.zeros <= order:
        problem = f"a transfer function of order {order} cannot have {counted(form.zeros, 'zero')}"
        raise QuadvisError(f"{problem}; give an order of 1 or more and at most as many zeros")
    if not 0.0 <= validation <= 0.9:
        raise QuadvisError(f"a share of {validation:g} for validation is not between 0 and 0.9")
    data = Experiment.of(_read(recording), (input, output), after)
    whole = Stretched(data, form)
    fitted = whole.first(1.0 - validation)
    need = 2 * form.count
    if fitted.seen < need:
        problem = f"{counted(fitted.seen, 'sample')} to fit {counted(form.count, 'coefficient')}: too few"
        raise QuadvisError(f"{problem}; record longer, or take a lower order")
    lag, poles = _best_delay(fitted) if delay else (0, _search(fitted, 0, list(_starts(fitted, 0))))
    return _result(whole, fitted, lag, poles)


def _read(recording: Recording | Ran | str | Path) -> Recording:
    if isinstance(recording, str | Path):
        from quadvis.output.foreign_signals import read_recording

        return read_recording(recording)
    return recording if isinstance(recording, Recording) else recording.signals


@dataclass(frozen=True)
class Stretched:
    """The samples that are fitted or simulated: all of them, or the ``first`` ones."""

    data: Experiment
    form: ModelForm
    count: int = 0

    def first(self, share: float) -> Stretched:
        """Return the first share of the samples."""
        return Stretched(self.data, self.form, max(1, round(share * self.data.u.size)))

    @property
    def size(self) -> int:
        """The number of places of the grid."""
        return self.count or self.data.u.size

    @property
    def output(self) -> Vector:
        """The recorded output."""
        return self.data.y[: self.size][self.data.seen]

    @property
    def seen(self) -> int:
        """The number of recorded outputs."""
        return int(self.output.size)

    def unknown(self, lag: int) -> int:
        """Return how many recorded outputs lie in a dead time (periods) from the beginning on."""
        return -(-lag // self.data.stride)

    def columns(self, denominator: Vector, lag: int) -> Matrix:
        """Return what the output is a linear combination of: one column for each coefficient but the poles'.

        They are the answers to the input for each power of the numerator, highest first, a constant, and the
        decays of the initial state. ``denominator`` (order,) leaves out the leading 1. The rows of the first
        ``lag`` periods are 0: what they answer to was before the recording.
        """
        form, data = self.form, self.data
        below = np.concatenate([[1.0], denominator])
        u = data.u[: self.size] - data.u[0]
        if lag:
            u = np.concatenate([np.zeros(lag), u[:-lag]])
        filters = [_sampled(form, power, below, data.period) for power in range(form.zeros, -1, -1)]
        lfilter = library("scipy.signal").lfilter
        with np.errstate(all="ignore"):
            found = [lfilter(above, poles, u) for above, poles in filters]
            poles = filters[-1][1]
            pulse = np.zeros(self.size)
            pulse[lag] = 1.0
            decays = [lfilter(row, poles, pulse) for row in np.eye(form.order)]
        columns = np.column_stack([*found, np.ones(self.size), *decays])[data.seen]
        columns[: self.unknown(lag)] = 0.0
        return np.asarray(np.nan_to_num(np.clip(columns, -HUGE, HUGE), nan=HUGE), np.float64)


def _sampled(form: ModelForm, power: int, below: Vector, period: float) -> tuple[Vector, Vector]:
    """Return the filter of ``s^power / below``, or ``z^power / below``, between samples of a held input."""
    if form.discrete:
        above = np.zeros(form.order + 1)
        above[form.order - power] = 1.0
        return above, below
    above = np.zeros(power + 1)
    above[0] = 1.0
    with np.errstate(all="ignore"):
        numerator, poles, _ = library("scipy.signal").cont2discrete((above, below), period, method="zoh")
    return np.nan_to_num(numerator[0]), np.nan_to_num(poles)


def _projected(stretch: Stretched, denominator: Vector, lag: int) -> tuple[Vector, Vector]:
    """Return the best linear coefficients for a denominator, and what they leave of the known output."""
    columns, output = stretch.columns(denominator, lag), stretch.output.copy()
    output[: stretch.unknown(lag)] = 0.0
    sizes = np.abs(columns).max(axis=0)
    sizes[sizes == 0.0] = 1.0
    found = np.linalg.lstsq(columns / sizes, output, rcond=1e-12)[0] / sizes
    return found, output - columns @ found


def _cost(stretch: Stretched, denominator: Vector, lag: int) -> float:
    """Return the mean squared error that is left with a denominator."""
    rest = _projected(stretch, denominator, lag)[1]
    return float(rest @ rest) / max(1, rest.size - stretch.unknown(lag))


def _search(stretch: Stretched, lag: int, starts: list[Vector]) -> Vector:
    """Return the denominator with the smallest error that is found from several starts."""
    ranked = sorted(starts, key=lambda start: _cost(stretch, start, lag))[:STARTS]
    found = []
    for start in ranked:
        sizes = np.where(np.abs(start) > 1e-12, np.abs(start), 1.0)
        result = library("scipy.optimize").least_squares(
            lambda scaled, sizes=sizes: _projected(stretch, scaled * sizes, lag)[1],
            start / sizes, method="lm", xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=400,
        )  # fmt: skip
        found.append((float(result.cost), result.x * sizes))
    return np.asarray(min(found, key=lambda pair: pair[0])[1], np.float64)


def _best_delay(stretch: Stretched) -> tuple[int, Vector]:
    """Return the dead time (periods of the grid) with the smallest error, and its denominator."""
    trials: list[tuple[float, int, Vector]] = []
    for lag in range(min(MOST_DELAYS, stretch.size // 4) + 1):
        announce(f"a delay of {counted(lag, 'sample')}")
        starts = [*_starts(stretch, lag, 4), *(trial[2] for trial in trials[-1:])]
        trials.append(
            min(((_cost(stretch, start, lag), lag, start) for start in starts), key=lambda trial: trial[0])
        )
    likely = sorted(trials, key=lambda trial: trial[0])[:STARTS]
    found = []
    for _, lag, start in likely:
        denominator = _search(stretch, lag, [start, *_starts(stretch, lag, 4)])
        found.append((_cost(stretch, denominator, lag), lag, denominator))
    best = min(found, key=lambda trial: trial[0])
    while (beside := _beside(stretch, best)) is not best:
        best = beside
    return best[1:]


def _beside(stretch: Stretched, best: tuple[float, int, Vector]) -> tuple[float, int, Vector]:
    """Return what a dead time of one period less or more finds, or the best if it is no better."""
    trials = [best]
    for lag in (best[1] - 1, best[1] + 1):
        if 0 <= lag <= min(MOST_DELAYS, stretch.size // 4):
            denominator = _search(stretch, lag, [best[2]])
            trials.append((_cost(stretch, denominator, lag), lag, denominator))
    return min(trials, key=lambda trial: trial[0])


def _starts(stretch: Stretched, lag: int, slowest: int = SLOWEST) -> Iterator[Vector]:
    """Yield denominators to start from: of ARX models at rates down to a part of the output's.

    Real poles at several speeds follow, for recordings of which no such model is of any use.
    """
    data, form = stretch.data, stretch.form
    y = stretch.output
    stride, u = data.stride, data.u[: stretch.size]
    u = np.concatenate([np.full(lag, u[0]), u[: u.size - lag]])
    held = (
        np.add.reduceat(u, np.arange(0, u.size, stride)) / stride
    )  # the mean over each sample of the output
    every = 1
    while y.size // every > 4 * form.count and every <= slowest:
        coarse = y[::every]
        driven = np.add.reduceat(held, np.arange(0, held.size, every))[: coarse.size] / every
        several = list(_arx_poles(driven, coarse, form.order))
        for poles in several[:1] + several[1:][-1:]:
            yield _denominator(poles, every * stride * data.period, data.period, form.discrete)
        every *= 4
    if slowest < SLOWEST:
        return
    for speed in np.geomspace(4.0 / (stretch.size * data.period), 1.0 / data.period, 6):
        rates = -speed * np.geomspace(1.0, 2.0, form.order)
        yield _denominator(np.exp(rates * data.period), data.period, data.period, form.discrete)


def _arx_poles(u: Vector, y: Vector, order: int) -> Iterator[Vector]:
    """Yield the poles of the ARX model, then those of each round of Steiglitz and McBride."""
    lfilter = library("scipy.signal").lfilter
    u, y = u - u.mean(), y - y.mean()
    below = np.array([1.0])
    for _ in range(ROUNDS):
        with np.errstate(all="ignore"):
            past, driven = (lfilter([1.0], below, signal) for signal in (y, u))
        if not (np.isfinite(past).all() and np.isfinite(driven).all()):
            return
        rows = [-past[order - lag : past.size - lag] for lag in range(1, order + 1)]
        rows += [driven[order - lag : driven.size - lag] for lag in range(order + 1)]
        found = np.linalg.lstsq(np.column_stack(rows), past[order:], rcond=1e-12)[0]
        poles = np.roots(np.concatenate([[1.0], found[:order]]))
        if poles.size < order or not np.isfinite(poles).all():
            return
        inside = np.where(np.abs(poles) > 1.0, 1.0 / poles.conjugate(), poles)  # the filter must be stable
        below = np.real(np.poly(inside))
        yield inside


def _denominator(poles: Vector, period: float, grid: float, discrete: bool) -> Vector:
    """Return the coefficients, without the leading 1, of poles that were found at one period (s)."""
    sizes = np.maximum(np.abs(poles), 1e-6)
    turned = np.where((np.abs(poles.imag) < 1e-12) & (poles.real < 0.0), sizes, poles)  # no rate gives these
    rates = np.log(np.where(np.abs(turned) < 1e-6, 1e-6, turned).astype(complex)) / period
    return np.asarray(np.real(np.poly(np.exp(rates * grid) if discrete else rates))[1:])


def _result(whole: Stretched, fitted: Stretched, lag: int, denominator: Vector) -> Identified:
    """Return the model with its deviations, judged on the samples that were not fitted."""
    form, data = whole.form, whole.data
    linear, rest = _projected(fitted, denominator, lag)
    deviations = _deviations(fitted, lag, denominator, linear, rest)
    ways, known = form.zeros + 1, fitted.unknown(lag)
    simulated = whole.columns(denominator, lag) @ linear
    simulated[:known] = math.nan
    rest = rest[known:]
    beyond = fitted.seen if whole.seen - fitted.seen >= 2 else known
    return Identified(
        names=data.names,
        unit=data.unit,
        numerator=linear[:ways],
        denominator=np.concatenate([[1.0], denominator]),
        deviations=(deviations[form.order : form.order + ways], np.append(0.0, deviations[: form.order])),
        delay=lag * data.period,
        period=data.period if form.discrete else 0.0,
        fit=_fit(whole.output[beyond:], simulated[beyond:]),
        fit_own=_fit(fitted.output[known:], fitted.output[known:] - rest),
        noise=math.sqrt(float(rest @ rest) / max(1, rest.size - form.count)),
        colour=_colour(rest),
        samples=(rest.size, whole.seen - fitted.seen),
        simulated=(
            data.begin + data.period * np.arange(float(whole.size))[data.seen],
            whole.output,
            simulated,
        ),
        longest=lag == MOST_DELAYS,
    )


def _deviations(stretch: Stretched, lag: int, denominator: Vector, linear: Vector, rest: Vector) -> Vector:
    """Return the standard deviations of the coefficients, those of the denominator first.

    They are those of white noise on the output: the roots of s^2 (J' J)^-1, with the whole Jacobian J.
    """
    form = stretch.form
    steps = 1e-6 * np.maximum(np.abs(denominator), 1e-9)
    slopes = []
    for index, step in enumerate(steps.tolist()):
        ends = [denominator.copy() for _ in range(2)]
        ends[0][index] += step
        ends[1][index] -= step
        above, below = (stretch.columns(end, lag) @ linear for end in ends)
        slopes.append((above - below) / (2.0 * step))
    columns = stretch.columns(denominator, lag)
    ways = form.zeros + 1
    own = np.column_stack([*slopes, columns[:, :ways]])
    sizes = np.linalg.norm(own, axis=0)
    sizes[sizes == 0.0] = 1.0
    # What offset and initial state can do in place of the coefficients says nothing of these.
    own = _without(own / sizes, columns[:, ways:])
    _, singular, turned = np.linalg.svd(own, full_matrices=False)
    if not singular[-1] > VAGUE * singular[0]:
        problem = f"the recording does not determine {counted(form.order + ways, 'coefficient')}"
        name = quoted(stretch.data.names[0])
        raise QuadvisError(f"{problem}; take a lower order, or let {name} move at more frequencies")
    variance = float(rest @ rest) / max(1, rest.size - stretch.unknown(lag) - form.count)
    found = np.sqrt(variance * ((turned / singular[:, None]) ** 2).sum(axis=0)) / sizes
    return np.asarray(found, np.float64)


def _without(columns: Matrix, others: Matrix) -> Matrix:
    """Return what is left of columns that others do not span."""
    sizes = np.linalg.norm(others, axis=0)
    basis, singular, _ = np.linalg.svd(others[:, sizes > 0.0] / sizes[sizes > 0.0], full_matrices=False)
    basis = basis[:, singular > VAGUE * singular[0]]
    return np.asarray(columns - basis @ (basis.T @ columns), np.float64)


def _fit(measured: Vector, simulated: Vector) -> float:
    """Return the normalised root mean square fit in percent: 100 is perfect, 0 as good as the mean."""
    spread = float(np.linalg.norm(measured - measured.mean()))
    wrong = float(np.linalg.norm(measured - simulated))
    return 100.0 * (1.0 - wrong / spread) if spread else math.nan


def _colour(rest: Vector) -> float:
    """Return the correlation of neighbouring residuals, near 0 if they are white."""
    power = float(rest @ rest)
    return float(rest[1:] @ rest[:-1]) / power if power else 0.0
