"""The mathematics that blocks share is the same for a float and for an array."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import all_finite, clip, copied, inward, passed, reached, saturated, zeros_like

NUMBERS = st.floats(-10.0, 10.0)


@given(st.lists(NUMBERS, min_size=1, max_size=4), NUMBERS, NUMBERS)
def test_an_array_is_clipped_as_its_elements_are(values: list[float], lower: float, upper: float) -> None:
    found = clip(np.array(values), lower, upper)
    assert found.tolist() == [clip(value, lower, upper) for value in values]
    assert all(min(lower, upper) <= value <= upper for value in found)  # the upper one wins if they cross


@given(st.lists(NUMBERS, min_size=1, max_size=4), NUMBERS, NUMBERS)
def test_an_array_goes_no_further_outward_than_its_elements(
    slopes: list[float], one: float, other: float
) -> None:
    lower, upper = min(one, other), max(one, other)
    values = np.linspace(lower, upper, len(slopes))
    found = inward(np.array(slopes), values, lower, upper)
    assert found.tolist() == [
        inward(*pair, lower, upper) for pair in zip(slopes, values.tolist(), strict=True)
    ]


def test_nan_stays_nan_at_a_limit() -> None:
    assert math.isnan(clip(math.nan, -1.0, 1.0)) and math.isnan(saturated(math.nan, 1.0))
    assert np.isnan(clip(np.array([math.nan]), -1.0, 1.0)).all()


@pytest.mark.parametrize("value", [2.5, np.array([-1.0, 3.0])])
def test_a_copy_lives_apart_and_zeros_have_its_shape(value: float | np.ndarray) -> None:
    first, zeros = copied(value), zeros_like(value)
    assert np.array_equal(first, value) and np.shape(zeros) == np.shape(value) and not np.any(zeros)
    assert isinstance(value, float) or not np.shares_memory(first, value)


def test_finite_means_every_element() -> None:
    assert all_finite(1.0) and all_finite(np.ones(2))
    assert not all_finite(math.inf) and not all_finite(np.array([0.0, math.nan]))


@given(st.integers(0, 10**6), st.sampled_from([0.001, 0.01, 0.1, 1 / 3]))
def test_a_sum_of_periods_reaches_its_tick_and_no_other(tick: int, period: float) -> None:
    instant = math.fsum([period] * (tick % 1000)) + period * (tick - tick % 1000)
    assert reached(tick * period, instant) and not passed(tick * period, instant)
    assert not reached((tick - 1) * period, instant) and passed((tick + 1) * period, instant)


def test_nothing_is_reached_or_passed_by_nan() -> None:
    assert not reached(math.nan, 0.0) and not passed(math.nan, 0.0) and not passed(0.0, math.nan)
    assert reached(0.3, np.array([0.1 + 0.2, 0.4])).tolist() == [True, False]
