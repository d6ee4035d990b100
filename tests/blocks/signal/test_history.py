import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis_blocks.signal.history import History

RATE = "100 Hz"


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.0, 0.39))
def test_of_a_straight_line_it_gives_the_value_at_any_instant(
    start: float, slope: float, instant: float
) -> None:
    line = start + slope * 0.01 * np.arange(40)
    result = drive(History(), u=line, instant=instant, rate=RATE)
    later = result.time >= instant
    assert result.y[later] == pytest.approx(start + slope * instant, abs=1e-12)
    assert result.ok[later].all()


def test_between_samples_of_a_curve_it_is_off_by_what_the_bend_allows() -> None:
    times = 0.01 * np.arange(200)
    instants = np.maximum(times - 0.1234, 0.0)
    result = drive(History(), u=np.sin(5 * times), instant=instants, rate=RATE)
    assert np.abs(result.y - np.sin(5 * instants)).max() <= 25 * 0.01**2 / 8


def test_the_newest_sample_counts() -> None:
    result = drive(History(), u=[3.0, 7.0], instant=[0.0, 0.01], rate=RATE)
    assert result.y.tolist() == [3.0, 7.0] and result.ok.all()


def test_what_is_not_kept_any_more_is_the_oldest_sample_and_not_ok() -> None:
    result = drive(History(), u=np.arange(400.0), instant=0.5, rate=RATE)
    assert result.y[50:307] == pytest.approx(50.0)
    assert result.y[307:] == pytest.approx(np.arange(307, 400) - 256.0)
    assert result.ok[:307].tolist() == [False] * 50 + [True] * 257 and not result.ok[307:].any()


@pytest.mark.parametrize("instant", [np.nan, 0.5, np.inf])
def test_no_instant_or_one_to_come_gives_the_value_of_now(instant: float) -> None:
    result = drive(History(), u=[1.0, 2.0, 3.0], instant=instant, rate=RATE)
    assert result.y.tolist() == [1.0, 2.0, 3.0] and not result.ok.any()


def test_before_the_first_sample_there_is_the_first_one() -> None:
    result = drive(History(), u=[1.0, 2.0], instant=-1.0, rate=RATE)
    assert result.y.tolist() == [1.0, 1.0] and not result.ok.any()
