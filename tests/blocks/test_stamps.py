"""The rule of stamps, alone and in the blocks that use it."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import Driven, drive
from quadvis_blocks._stamps import AHEAD, BACK, MISSING, NEWS, REPEATED, RESTARTED, SIZE, begin, judge, note
from quadvis_blocks.estimation.attitude_filter import AttitudeFilter
from quadvis_blocks.estimation.position_filter import PositionFilter
from quadvis_blocks.estimation.reckoned_height import ReckonedHeight
from quadvis_blocks.signal.derivative import Derivative
from quadvis_blocks.signal.hold_valid import HoldValid
from quadvis_blocks.supervision.output_hold import OutputHold
from quadvis_blocks.supervision.staleness import Staleness

TICK, DELAY = 0.1, 0.1
TIMES = TICK * np.arange(100)


def judged(stamps: Any, times: Any = TIMES, restart: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the verdicts and instants of stamps that come one after the other."""
    clock = np.zeros(SIZE)
    begin(clock)
    found = []
    for time, stamp in zip(times, stamps, strict=False):
        before = clock.copy()
        first = judge(clock, float(stamp), float(time), restart)
        assert np.array_equal(clock, before, equal_nan=True)
        assert note(clock, float(stamp), float(time), restart) == first
        found.append(first)
    verdicts, instants = zip(*found, strict=True)
    return np.array(verdicts), np.array(instants)


def test_stamps_that_rise_count_as_they_stand() -> None:
    verdicts, instants = judged(TIMES - DELAY)
    assert (verdicts == NEWS).all() and (instants == TIMES - DELAY).all()


HOSTILE = [
    (1000.0, AHEAD), (1e300, AHEAD), (5.001, AHEAD), (math.inf, MISSING), (-math.inf, MISSING),
    (math.nan, MISSING), (-1000.0, BACK), (0.0, BACK), (4.7, BACK), (4.8, REPEATED), (-1e300, BACK),
]  # fmt: skip


@pytest.mark.parametrize(("stamp", "verdict"), HOSTILE)
def test_one_hostile_stamp_does_not_count_and_the_next_good_one_does(stamp: float, verdict: int) -> None:
    stamps = np.round(TIMES - DELAY, 9)
    stamps[50] = stamp
    verdicts, instants = judged(stamps, np.round(TIMES, 9))
    assert verdicts[50] == verdict
    assert (np.delete(verdicts, 50) == NEWS).all()
    assert (np.delete(instants, 50) == np.delete(stamps, 50)).all()


def test_without_a_clock_everything_is_of_now_until_the_first_stamp() -> None:
    verdicts, instants = judged([math.nan, math.nan, 0.15, math.nan, 0.35])
    assert verdicts.tolist() == [NEWS, NEWS, NEWS, MISSING, NEWS]
    assert instants[:3].tolist() == [0.0, 0.1, 0.15]


@pytest.mark.parametrize("back", [0.3, 0.35, 0.5, 1.0, 2.0, 3.7, 4.0, 5.0, 100.0, 1e6])
def test_a_clock_that_is_set_back_counts_again_after_a_while_as_old_as_before(back: float) -> None:
    stamps = TIMES - DELAY
    stamps[50:] -= back
    verdicts, instants = judged(stamps)
    counts = verdicts == NEWS
    assert counts[:50].all() and not counts[50:60].any() and counts[60:].all()
    assert instants[60:] == pytest.approx(TIMES[60:] - DELAY, abs=1e-7)
    assert (verdicts[53:60] == RESTARTED).all()


def test_a_clock_that_is_right_again_counts_at_once() -> None:
    stamps = TIMES - DELAY
    stamps[40:70] -= 0.3
    verdicts, instants = judged(stamps)
    assert (verdicts[70:] == NEWS).all() and (instants[70:] == stamps[70:]).all()


def test_a_clock_that_starts_again_twice_is_taken_twice() -> None:
    stamps = TIMES - DELAY
    stamps[30:] -= 2.5
    stamps[60:] -= 3.0
    verdicts, instants = judged(stamps)
    assert (verdicts[40:60] == NEWS).all() and (verdicts[70:] == NEWS).all()
    assert instants[70:] == pytest.approx(TIMES[70:] - DELAY)


def test_a_clock_that_started_again_and_is_set_right_in_part_is_taken_again() -> None:
    stamps = TIMES - DELAY
    stamps[30:] -= 2.5
    stamps[60:] += 1.5
    verdicts, instants = judged(stamps)
    assert (verdicts[70:] == NEWS).all()
    assert instants[70:] == pytest.approx(TIMES[70:] - DELAY)


def test_a_clock_that_is_ahead_is_never_taken() -> None:
    assert (judged(TIMES + 5.0)[0] == AHEAD).all()


def test_stamps_that_fall_are_no_clock() -> None:
    stamps = TIMES - DELAY
    stamps[50:] = 4.0 - 0.01 * np.arange(50)
    assert (judged(stamps)[0][50:] == BACK).all()


def test_frames_that_change_places_for_long_start_no_clock() -> None:
    stamps = TIMES - DELAY
    stamps[10:90] = stamps[10:90].reshape(-1, 2)[:, ::-1].ravel() - DELAY
    verdicts, instants = judged(stamps)
    assert (verdicts[10:90:2] == NEWS).all() and (verdicts[11:90:2] == BACK).all()
    assert (instants == stamps).all()


def test_frames_that_come_late_count_with_their_age() -> None:
    stamps = np.repeat(np.nan, 100)
    stamps[:50] = TIMES[:50] - DELAY
    stamps[50:54] = stamps[49]  # nothing comes for 0.4 s, then all comes 0.4 s later
    stamps[54:] = TIMES[54:] - DELAY - 0.4
    verdicts, instants = judged(stamps)
    assert (verdicts[54:] == NEWS).all() and (instants[54:] == stamps[54:]).all()


stamps_of_any_kind = st.lists(
    st.one_of(st.floats(-20.0, 30.0), st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 5.0, 1e308])),
    max_size=60,
)


@given(stamps_of_any_kind, st.floats(0.05, 3.0))
def test_whatever_comes_instants_rise_and_none_is_ahead(stamps: list[float], restart: float) -> None:
    verdicts, instants = judged(stamps, restart=restart) if stamps else (np.array([]), np.array([]))
    counted = (verdicts == NEWS) & np.isfinite(stamps)
    assert (instants[counted] <= TIMES[: len(stamps)][counted]).all()
    assert (np.diff(instants[counted]) > 0).all()


@given(stamps_of_any_kind)
def test_whatever_came_good_stamps_count_again_after_the_declared_time(stamps: list[float]) -> None:
    good = TIMES[len(stamps) :][:35]
    verdicts, _ = judged([*stamps, *(good - DELAY)])
    assert (verdicts[len(stamps) + 12 :] == NEWS).all()


def follow(stamps: Any) -> dict[str, Any]:
    """Feed blocks with a measurement of 1 m/s at the instants of right stamps, under other stamps."""
    right = TIMES - DELAY
    still = np.zeros((100, 3))
    climbing = np.column_stack((0 * right, 0 * right, right))
    blocks: dict[str, Driven] = {
        "derivative": drive(Derivative(), u=right, stamp=stamps, rate="10 Hz"),
        "hold": drive(HoldValid(), value=right, stamp=stamps, rate="10 Hz"),
        "output": drive(OutputHold(), u=right, stamp=stamps, rate="10 Hz"),
        "staleness": drive(Staleness(max_age=0.25), stamp=stamps, rate="10 Hz"),
        "position": drive(PositionFilter(), acceleration=still, position=still, stamp=stamps, rate="10 Hz"),
        "attitude": drive(AttitudeFilter(), angle=0.3, gyro=0.0, torque=0.0, stamp=stamps, rate="10 Hz"),
        "height": drive(
            ReckonedHeight(), position=climbing, velocity=0 * still + [0.0, 0.0, 1.0], stamp=stamps,
            blind=TIMES > 9.5, collective=0.5 * 9.81 + 0.1, roll=0.0, pitch=0.0, rate="10 Hz",
        ),
    }  # fmt: skip
    return blocks


def check(found: dict[str, Any], after: int) -> None:
    """Check that all is well from a tick on."""
    assert found["derivative"].ok[after:].all()
    assert found["derivative"].rate[after + 1 :] == pytest.approx(1.0, abs=1e-6)
    assert found["hold"].ok[after:].all() and not found["output"].stale[after:].any()
    assert not found["staleness"].stale[after:].any()
    assert found["position"].ok[after:].all() and found["position"].age[after:] == pytest.approx(DELAY)
    assert found["attitude"].estimate[-1] == pytest.approx(0.3, abs=0.01)
    assert found["height"].known_position[-1, 2] == pytest.approx(9.9, abs=0.2)
    assert found["height"].known_velocity[-1, 2] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("stamp", [1000.0, 5.5, 1e300, math.inf, -math.inf, math.nan, -1000.0, 4.0, 4.8, 0.0])
def test_every_block_goes_on_two_samples_after_one_hostile_stamp(stamp: float) -> None:
    stamps = TIMES - DELAY
    stamps[50] = stamp
    check(follow(stamps), 52)


@pytest.mark.parametrize("back", [0.5, 3.0, 5.0])
def test_every_block_follows_a_clock_that_started_again(back: float) -> None:
    stamps = TIMES - DELAY
    stamps[50:] -= back
    check(follow(stamps), 61)


@pytest.mark.parametrize("kind", [math.nan, 1000.0, -5.0])
def test_every_block_goes_on_two_samples_after_three_seconds_of_hostile_stamps(kind: float) -> None:
    stamps = TIMES - DELAY
    stamps[50:80] = kind
    found = follow(stamps)
    assert found["staleness"].stale[53:80].all() and found["output"].stale[53:80].all()
    check(found, 82)
