import math
from typing import Any

import numpy as np
import pytest

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.frame_news import FrameNews

NONE, FROZEN, BAD_STAMP, CLOCK_RESTARTED = 0, 4, 5, 6
TIMES = 0.1 * np.arange(60)
STAMPS = TIMES - 0.1


def watch(stamps: Any, value: Any = None, **more: Any) -> Driven:
    """Drive at 10 Hz with noisy measurements, unless others are given."""
    if value is None:
        value = np.random.default_rng(1).normal(size=(60, 4, 2))
    return drive(FrameNews(), stamp=stamps, value=value, rate="10 Hz", **more)


def test_good_frames_pass_with_their_stamps() -> None:
    found = watch(STAMPS)
    assert (found.instant == STAMPS).all() and found.fresh.all() and (found.reason == NONE).all()


def test_measurements_that_repeat_to_the_bit_are_a_frozen_camera() -> None:
    value = np.random.default_rng(1).normal(size=(60, 4, 2))
    value[20:40] = value[19]
    found = watch(STAMPS, value)
    assert (found.instant[20:40] == STAMPS[19]).all() and not found.fresh[20:40].any()
    assert (found.reason[20:40] == FROZEN).all()
    assert found.fresh[40:].all() and (found.reason[40:] == NONE).all()


@pytest.mark.parametrize("cycle", [2, 3, 7, 32])
def test_so_is_one_that_goes_round_in_old_ones(cycle: int) -> None:
    value = np.random.default_rng(1).normal(size=(120, 4, 2))
    value[40:100] = np.resize(value[40 - cycle : 40], (60, 4, 2))
    found = drive(FrameNews(), stamp=0.1 * np.arange(120) - 0.1, value=value, rate="10 Hz")
    assert not found.fresh[40:100].any() and (found.reason[40:100] == FROZEN).all()
    assert found.fresh[:40].all() and found.fresh[100:].all() and (found.reason[100:] == NONE).all()


def test_old_ones_among_new_ones_are_no_news_and_the_new_ones_are() -> None:
    value = np.random.default_rng(1).normal(size=(60, 4, 2))
    value[30:40:2] = value[[20, 28, 23, 20, 26]]
    found = watch(STAMPS, value)
    assert np.array_equal(np.flatnonzero(~found.fresh), np.arange(30, 40, 2))


def test_one_bit_is_enough_to_be_news() -> None:
    value = np.ones((60, 4, 2))
    value[:, 3, 1] += np.finfo(float).eps * np.arange(60)
    assert watch(STAMPS, value).fresh.all()


def test_circles_that_are_missing_do_not_hide_that_the_others_repeat() -> None:
    value = np.full((60, 4, 2), 7.0)
    value[:, 2] = math.nan
    assert (watch(STAMPS, value).reason[1:] == FROZEN).all()


def test_a_target_that_is_not_there_again_and_again_is_no_frozen_camera() -> None:
    assert watch(STAMPS, np.full((60, 4, 2), math.nan)).fresh.all()


def test_measurements_without_noise_may_repeat_where_the_user_says_so() -> None:
    found = drive(FrameNews(repeats="news"), stamp=STAMPS, value=np.ones((60, 4, 2)), rate="10 Hz")
    assert found.fresh.all() and (found.reason == NONE).all()


def test_without_a_measurement_stamps_alone_count() -> None:
    assert drive(FrameNews(), stamp=STAMPS, rate="10 Hz").fresh.all()


def test_a_detector_may_say_that_its_pictures_repeat() -> None:
    frozen = (TIMES >= 2.0) & (TIMES < 3.0)
    found = watch(STAMPS, frozen=frozen)
    assert np.array_equal(found.fresh, ~frozen)
    assert (found.reason[frozen] == FROZEN).all() and (found.reason[~frozen] == NONE).all()


@pytest.mark.parametrize("stamp", [1000.0, 6.5, math.nan, math.inf, -math.inf, -1000.0])
def test_stamps_that_cannot_be_have_their_reason(stamp: float) -> None:
    stamps = STAMPS.copy()
    stamps[30:33] = stamp + np.array([0.0, -0.2, -0.4])
    found = watch(stamps)
    assert (found.instant[30:33] == STAMPS[29]).all() and (found.reason[30:33] == BAD_STAMP).all()
    assert found.fresh[33:].all() and (found.reason[33:] == NONE).all()


@pytest.mark.parametrize("back", [0.3, 1.0, 2.9, 100.0])
def test_a_clock_that_started_again_is_put_into_the_time_of_the_run(back: float) -> None:
    stamps = STAMPS.copy()
    stamps[30:] -= back
    found = watch(stamps)
    assert not found.fresh[30:40].any() and (found.reason[33:40] == CLOCK_RESTARTED).all()
    assert found.fresh[40:].all() and found.instant[40:] == pytest.approx(STAMPS[40:])


def test_a_stamp_that_stands_still_is_no_trouble_but_no_news() -> None:
    found = watch(np.where(TIMES < 3.0, STAMPS, STAMPS[29]))
    assert not found.fresh[30:].any() and (found.reason == NONE).all()


def test_before_the_first_frame_there_is_none() -> None:
    found = watch(np.where(TIMES < 1.0, math.nan, STAMPS))
    assert np.isnan(found.instant[:10]).all() and not found.fresh[:10].any() and found.fresh[10:].all()
    assert (found.reason == NONE).all()
