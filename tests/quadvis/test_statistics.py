"""Statistics that are taken piece by piece, against numpy with all samples at once, to the bit."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from quadvis.output.statistics import STATISTICS, RunningSum

WHOLE: dict[str, Callable[[NDArray[np.float64]], Any]] = {
    "rms": lambda values: float(np.sqrt(np.mean(values**2))),
    "max": lambda values: float(np.max(np.abs(values))),
    "mean": lambda values: float(np.mean(values)),
    "lowest": lambda values: float(np.min(values)),
    "highest": lambda values: float(np.max(values)),
    "final": lambda values: tuple(values[-1].tolist()) if values.shape[1] > 1 else values[-1, 0],
    "count": lambda values: float(np.count_nonzero(values.any(axis=1))),
}


def value(name: str, values: NDArray[np.float64], pieces: int = 1) -> Any:
    """Return a statistic of samples that come in so many pieces."""
    statistic = STATISTICS[name](*values.shape)
    for piece in np.array_split(values, pieces):
        if len(piece):
            statistic.add(piece)
    return statistic.value


SAMPLES = arrays(float, st.tuples(st.integers(1, 20), st.integers(1, 4)), elements=st.floats(-1e3, 1e3))


def test_every_statistic_has_its_counterpart() -> None:
    assert list(WHOLE) == list(STATISTICS)


@given(SAMPLES, st.integers(1, 5))
def test_statistics_are_those_of_numpy(values: NDArray[np.float64], pieces: int) -> None:
    for name, whole in WHOLE.items():
        assert value(name, values, pieces) == whole(values), name


@pytest.mark.parametrize(
    "size", [1, 7, 8, 128, 129, 4097, 8192, 8193, 16_383, 16_385, 24_999, 65_537, 200_003]
)
@pytest.mark.parametrize("pieces", [1, 3, 17])
def test_sums_of_many_samples_are_those_of_numpy_to_the_bit(size: int, pieces: int) -> None:
    values = np.random.default_rng(size).normal(1.0, 1e3, (size, 3))
    for name in ("rms", "mean"):
        assert value(name, values, pieces) == WHOLE[name](values), name


def test_a_sum_keeps_only_what_numpy_still_has_to_add() -> None:
    size = 40 * RunningSum.LEAF
    total = RunningSum(size)
    kept = 0
    for piece in np.array_split(np.ones(size), 997):
        total.add(piece)
        kept = max(kept, sum(map(len, total._waiting)) + len(total._sums))
    assert total.value == size
    assert kept < RunningSum.LEAF + 100


@pytest.mark.parametrize("taken", [1, 100, 8192, 20_000, 99_999])
def test_the_mean_of_fewer_samples_than_were_promised_is_that_of_those_that_came(taken: int) -> None:
    values = np.random.default_rng(taken).normal(size=(taken, 1))
    statistic = STATISTICS["mean"](100_000, 1)
    statistic.add(values)
    assert statistic.value == pytest.approx(float(np.mean(values)), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("name", [name for name in STATISTICS if name != "final"])
@pytest.mark.parametrize("place", [0, 1, 9_000, 19_999])
def test_a_missing_sample_leaves_no_number(name: str, place: int) -> None:
    values = np.ones((20_000, 1))
    values[place] = math.nan
    assert math.isnan(value(name, values, 3))


@pytest.mark.parametrize("name", STATISTICS)
def test_no_samples_leave_no_number(name: str) -> None:
    assert math.isnan(STATISTICS[name](0, 1).value)  # type: ignore[arg-type]
