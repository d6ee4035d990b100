import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis_blocks.supervision.staleness import Staleness


def test_the_age_counts_from_the_stamp() -> None:
    found = drive(Staleness(), stamp=[math.nan, 0.05, 0.05, 0.05, 0.25], rate="10 Hz")
    assert found.age == pytest.approx([0.0, 0.05, 0.15, 0.25, 0.15])
    assert found.stale.tolist() == [False, False, True, True, True]


def test_a_sequence_number_that_stands_still_is_no_news() -> None:
    found = drive(Staleness(), sequence=[1, 2, 2, 2, 2, 3], rate="20 Hz")
    assert found.age == pytest.approx([0.0, 0.0, 0.05, 0.1, 0.15, 0.0])
    assert found.stale.tolist() == [False, False, False, False, True, False]


def test_a_sensor_whose_noise_repeats_is_dead() -> None:
    found = drive(Staleness(), value=[[0.1, 0.2], [0.1, 0.3]] + [[0.2, 0.3]] * 4, rate="20 Hz")
    assert found.age == pytest.approx([0.0, 0.0, 0.0, 0.05, 0.1, 0.15])


def test_nan_and_stamps_of_the_future_are_no_news() -> None:
    assert drive(Staleness(), stamp=[math.nan] * 3, rate="10 Hz").age == pytest.approx([0.0, 0.1, 0.2])
    assert drive(Staleness(), stamp=[9.0] * 3, rate="10 Hz").age == pytest.approx([0.0, 0.1, 0.2])
    assert drive(Staleness(), value=[1.0, math.nan, math.nan], rate="10 Hz").age == pytest.approx(
        [0, 0.1, 0.2]
    )


def test_nothing_connected_becomes_stale() -> None:
    assert drive(Staleness(), rate="10 Hz", steps=4).stale.tolist() == [False, False, True, True]


@given(st.lists(st.booleans(), min_size=3, max_size=60), st.floats(0.0, 1.0))
def test_it_is_stale_exactly_where_the_last_news_is_too_old(news: list[bool], max_age: float) -> None:
    found = drive(Staleness(max_age=max_age), sequence=np.cumsum(news), rate="20 Hz")
    last = 0.0
    for k, new in enumerate(news):
        last = k * 0.05 if new else last
        assert found.stale[k] == (k * 0.05 - last > max_age + 1e-9)
