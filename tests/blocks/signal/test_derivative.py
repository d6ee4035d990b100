import math

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.derivative import Derivative

NAN = math.nan


def test_a_ramp_gives_its_slope_after_the_first_sample() -> None:
    result = drive(Derivative(), u=[4.0, 4.1, 4.2], rate="20 Hz")
    assert result.rate == pytest.approx([0.0, 2.0, 2.0])
    assert result.ok.tolist() == [False, True, True]


def test_successive_ticks_are_no_gap_at_any_rate() -> None:
    assert drive(Derivative(), u=[0, 1, 3], rate="0.1 Hz").rate == pytest.approx([0.0, 0.1, 0.2])


def test_the_error_stays_under_the_documented_bound() -> None:
    period, omega = 0.05, 2.0
    time = np.arange(200) * period
    rate = drive(Derivative(), u=np.sin(omega * time), rate="20 Hz").rate
    worst = np.abs(rate[1:] - omega * np.cos(omega * time[1:])).max()
    assert worst <= omega**2 * period / 2
    assert worst >= 0.9 * omega**2 * period / 2


def test_noise_grows_as_documented() -> None:
    u = np.random.default_rng(1).normal(0.0, 0.01, 20000)
    rate = drive(Derivative(), u=u, rate="10 Hz").rate
    assert np.std(rate) == pytest.approx(0.01 * math.sqrt(2.0) / 0.1, rel=0.02)


def test_the_true_time_between_stamps_counts_and_not_the_period() -> None:
    result = drive(Derivative(), u=[0.0, 0.3, 0.4], stamp=[-0.12, 0.03, 0.08], rate="10 Hz")
    assert result.rate == pytest.approx([0.0, 2.0, 2.0])


def test_frames_seen_twice_give_one_rate_and_no_comb() -> None:
    stamps = np.repeat(np.arange(6) * 0.1, 2)  # 10 FPS seen at 20 Hz
    held = drive(Derivative(), u=3.0 * stamps, stamp=stamps, rate="20 Hz")
    assert held.rate == pytest.approx([0.0, 0.0] + [3.0] * 10)
    without = drive(Derivative(), u=3.0 * stamps, rate="20 Hz")
    assert without.rate[2:] == pytest.approx([6.0, 0.0] * 5)  # the literal reading: twice the rate, then none


def test_an_older_frame_than_the_last_changes_nothing() -> None:
    result = drive(Derivative(), u=[0.0, 1.0, 99.0, 3.0], stamp=[0.0, 0.1, 0.05, 0.3], rate="10 Hz")
    assert result.rate == pytest.approx([0.0, 10.0, 10.0, 10.0])


def test_a_missing_sample_keeps_the_last_rate_and_the_next_uses_the_longer_time() -> None:
    result = drive(Derivative(), u=[0.0, 0.1, NAN, 0.3], rate="10 Hz")
    assert result.rate == pytest.approx([0.0, 1.0, 1.0, 1.0])
    flagged = drive(Derivative(), u=[0.0, 0.1, 77.0, 0.3], valid=[True, True, False, True], rate="10 Hz")
    assert flagged.rate == pytest.approx(result.rate)


def test_after_a_gap_it_starts_afresh_without_a_spike() -> None:
    u = [0.0, 0.1, *[NAN] * 5, 0.9, 1.0]
    result = drive(Derivative(gap_reset=0.4), u=u, rate="10 Hz")
    # the rate is kept for 0.4 s after the last sample, then zero; the first sample after the gap gives none
    assert result.rate == pytest.approx([0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0])
    assert result.ok.tolist() == [False, *[True] * 5, False, False, True]


def test_a_gap_of_exactly_the_limit_is_still_spanned() -> None:
    result = drive(Derivative(gap_reset=0.3), u=[0.0, 0.1, NAN, NAN, 0.4], rate="10 Hz")
    assert result.rate[4] == pytest.approx(1.0)


def test_a_frame_that_stays_the_same_for_too_long_gives_no_rate() -> None:
    stamps = [0.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
    result = drive(Derivative(gap_reset=0.4), u=stamps, stamp=stamps, rate="10 Hz")
    assert result.rate == pytest.approx([0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0])


def test_a_latency_longer_than_the_limit_is_no_gap() -> None:
    stamps = np.arange(8) * 0.1 - 1.0
    assert drive(Derivative(), u=stamps, stamp=stamps, rate="10 Hz").rate[1:] == pytest.approx([1.0] * 7)


def test_arrays_are_differenced_element_by_element() -> None:
    result = drive(Derivative(), u=[[0.0, 1.0], [0.1, 0.8]], rate="10 Hz")
    assert np.allclose(result.rate, [[0.0, 0.0], [1.0, -2.0]])


def test_a_gap_of_no_length_is_refused() -> None:
    with pytest.raises(ParameterError, match="gap_reset must be above 0 s, got 0 s"):
        Derivative(gap_reset=0.0)
