import math

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.hold_valid import HoldValid

NAN = math.nan


def test_a_valid_value_passes_and_is_held_while_it_is_missing() -> None:
    result = drive(HoldValid(max_age=0.2), value=[1.0, 2.0, NAN, NAN, NAN, 6.0], rate="10 Hz")
    assert result.held.tolist() == [1.0, 2.0, 2.0, 2.0, 2.0, 6.0]
    assert result.age == pytest.approx([0.0, 0.0, 0.1, 0.2, 0.3, 0.0])
    assert result.ok.tolist() == [True, True, True, True, False, True]


def test_the_flag_alone_makes_a_value_invalid() -> None:
    result = drive(HoldValid(), value=[1.0, 9.0, 3.0], valid=[True, False, True])
    assert result.held.tolist() == [1.0, 1.0, 3.0]


def test_before_the_first_valid_value_it_gives_the_initial_one_and_is_not_ok() -> None:
    result = drive(HoldValid(max_age=10.0), value=[NAN, NAN, 1.0], initial=-4.0)
    assert result.held.tolist() == [-4.0, -4.0, 1.0]
    assert result.age == pytest.approx([0.0, 1.0, 0.0])
    assert result.ok.tolist() == [False, False, True]


def test_the_age_counts_from_the_stamp_of_the_measurement() -> None:
    result = drive(HoldValid(max_age=0.25), value=[1.0, 1.0, NAN], stamp=[-0.1, 0.0, NAN], rate="10 Hz")
    assert result.age == pytest.approx([0.1, 0.1, 0.2])


def test_a_value_that_was_overtaken_on_its_way_is_left_out() -> None:
    result = drive(HoldValid(), value=[1.0, 3.0, 2.0, 4.0], stamp=[-0.2, 0.0, -0.1, 0.1], rate="10 Hz")
    assert result.held.tolist() == [1.0, 3.0, 3.0, 4.0]
    assert result.age == pytest.approx([0.2, 0.1, 0.2, 0.2])


def test_a_frame_that_is_there_still_is_no_news() -> None:
    result = drive(HoldValid(), value=[1.0, 2.0, 3.0], stamp=[-0.1, -0.1, 0.1], rate="10 Hz")
    assert result.held.tolist() == [1.0, 1.0, 3.0]
    assert result.age == pytest.approx([0.1, 0.2, 0.1])


def test_a_clock_that_was_ahead_once_does_not_shut_out_what_comes_later() -> None:
    # Nor does it count itself: a stamp ahead of the time is no news.
    result = drive(HoldValid(), value=[1.0, 2.0, 3.0], stamp=[100.0, 0.1, 0.2], rate="10 Hz")
    assert result.held.tolist() == [0.0, 2.0, 3.0]


def test_one_missing_element_makes_the_whole_array_invalid() -> None:
    result = drive(HoldValid(), value=[[1.0, 2.0], [3.0, NAN], [5.0, 6.0]])
    assert np.array_equal(result.held, [[1.0, 2.0], [1.0, 2.0], [5.0, 6.0]])


def test_a_negative_age_is_refused() -> None:
    with pytest.raises(ParameterError, match="max_age must be at least 0 s, got -1 s"):
        HoldValid(max_age=-1.0)
