import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.vision_watchdog import VisionWatchdog

FRESH, COAST, LEVEL, LAND = range(4)
NONE, NO_FRAMES, TARGET_LOST, REARMING = range(4)
TICK, FRAME, LATENCY = 0.05, 0.1, 0.1  # s


def watch(frames: dict[float, bool], duration: float, block: VisionWatchdog | None = None) -> Driven:
    """Drive the watchdog at 20 Hz with frames: when each was taken, and whether it is good."""
    stamps, valid = [], []
    for k in range(round(duration / TICK)):
        there = [stamp for stamp in frames if stamp + LATENCY <= k * TICK + 1e-9]
        stamps.append(max(there, default=math.nan))
        valid.append(bool(there) and frames[max(there)])
    return drive(block or VisionWatchdog(), stamp=stamps, valid=valid, rate="20 Hz")


def steady(begin: float, end: float, good: bool = True) -> dict[float, bool]:
    """Frames of a camera of 10 frames/s."""
    return {round(k * FRAME, 6): good for k in range(round(begin / FRAME), round(end / FRAME))}


def entered(found: Driven, state: int, after: float = 0.0) -> float:
    """The first time, after a time, at which a state is there; infinity for never."""
    times = found.time[(found.signals["state"] == state) & (found.time >= after)]
    return float(times[0]) if len(times) else math.inf


def test_the_states_of_a_camera_that_dies_follow_the_timing_table() -> None:
    found = watch(steady(0, 3.1), 10.0)  # the last frame is taken at 3.0 s
    assert entered(found, FRESH) == pytest.approx(0.6)  # frames of 0 to 0.5 s are there: six, over 0.5 s
    assert entered(found, COAST, 1.0) == pytest.approx(3.3)
    assert entered(found, LEVEL) == pytest.approx(5.05)
    assert entered(found, LAND) == pytest.approx(8.05)
    assert (found.reason[found.time > 3.29] == NO_FRAMES).all()
    assert found.rearmed.sum() == 1


@given(st.integers(0, 99))
def test_the_policy_reacts_within_three_tenths_of_a_second_whenever_vision_is_lost(percent: int) -> None:
    lost = 2.0 + percent / 100 * FRAME  # frames taken until then arrive, none after
    found = watch({stamp: True for stamp in steady(0, 4) if stamp <= lost}, 4.0)
    assert lost < entered(found, COAST, 1.0) <= lost + 0.3 + 1e-9
    assert found.stale[found.time >= lost + 0.3].all()


def test_one_lost_frame_is_no_reason_to_worry_and_two_are() -> None:
    frames = steady(0, 4)
    one = {stamp: good for stamp, good in frames.items() if stamp != 2.0}
    assert entered(watch(one, 4.0), COAST, 1.0) == math.inf
    two = {stamp: good for stamp, good in one.items() if stamp != 2.1}
    assert entered(watch(two, 4.0), COAST, 1.0) < 2.5


def test_a_target_that_is_not_found_is_told_from_a_camera_that_is_dead() -> None:
    blind = watch(steady(0, 2) | steady(2, 4, good=False), 4.0)
    assert (blind.reason[blind.time > 2.35] == TARGET_LOST).all()
    assert entered(blind, COAST, 1.0) == entered(watch(steady(0, 2), 4.0), COAST, 1.0)


def test_vision_that_comes_back_has_to_prove_itself() -> None:
    found = watch(steady(0, 2) | steady(5, 7), 7.0)
    assert entered(found, LEVEL) < 5.0
    assert entered(found, FRESH, 3.0) == pytest.approx(5.6)
    waiting = (found.time > 5.09) & (found.time < 5.59)
    assert (found.signals["state"][waiting] == LEVEL).all() and (found.reason[waiting] == REARMING).all()
    (moments,) = np.nonzero(found.rearmed)
    assert found.time[moments] == pytest.approx([0.6, 5.6])


def test_single_frames_now_and_then_do_not_keep_a_blind_craft_in_the_air_for_ever() -> None:
    found = watch(steady(0, 2) | {float(second): True for second in range(2, 12)}, 12.0)
    assert LAND in found.signals["state"]
    assert entered(found, LEVEL) < 4.5 and entered(found, LAND) < 7.5


def test_they_do_if_the_estimator_makes_the_most_of_them() -> None:
    frames = steady(0, 3.1) | dict.fromkeys([4.5, 6.0, 7.5], True)
    found = watch(frames, 13.0, VisionWatchdog(clock="frame"))
    assert entered(found, COAST, 1.0) == pytest.approx(3.3)
    assert entered(found, LEVEL) == pytest.approx(9.55)
    assert entered(found, LAND) == pytest.approx(12.55)


def test_before_the_first_frame_nothing_is_trusted() -> None:
    found = watch({}, 6.0)
    assert entered(found, FRESH) == math.inf
    assert found.stale.all() and found.signals["state"][0] == COAST and found.reason[0] == NO_FRAMES
    assert entered(found, LAND) == pytest.approx(5.05)


gaps = st.lists(st.tuples(st.floats(0.05, 4.0), st.booleans()), min_size=5, max_size=40)


@given(gaps, st.integers(1, 8), st.floats(0.0, 1.0))
def test_whatever_frames_come_the_states_keep_their_order_and_their_proofs(
    gaps: list[tuple[float, bool]], needed: int, proof: float
) -> None:
    times = np.cumsum([gap for gap, _ in gaps])
    frames = {float(time): good for time, (_, good) in zip(times, gaps, strict=True)}
    found = watch(frames, min(times[-1] + 6.0, 40.0), VisionWatchdog(frames=needed, proof=proof))
    good = np.array([time for time, well in frames.items() if well])
    check_every_change(found, good, needed, proof)


@given(st.lists(st.sampled_from("gggggggb-"), min_size=20, max_size=120))
def test_nor_do_they_when_a_steady_camera_misses_some(kinds: list[str]) -> None:
    frames = {k * FRAME: kind == "g" for k, kind in enumerate(kinds) if kind != "-"}
    found = watch(frames, len(kinds) * FRAME)
    check_every_change(found, np.array([time for time, well in frames.items() if well]), 5, 0.5)


def check_every_change(found: Driven, good: np.ndarray, needed: int, proof: float) -> None:
    """Check every step of a run against what the good frames allow."""
    state, time = found.signals["state"], found.time
    trusted = 0.0  # the last good frame of the FRESH state
    before = COAST
    for k in range(len(time)):
        there = good[good + LATENCY <= time[k] + 1e-9]
        age = time[k] - there[-1] if len(there) else math.inf
        assert found.stale[k] == (age > 0.25 + 1e-9)
        if state[k] > before:
            assert state[k] == before + 1  # never one left out
            gone = {COAST: 0.25, LEVEL: 2.0, LAND: 5.0}[int(state[k])]
            assert found.stale[k] and time[k] - trusted > gone
        elif state[k] < before:
            assert state[k] == FRESH and found.rearmed[k]
            row = there[-needed:]
            assert len(row) == needed and (np.diff(row) <= 0.25 + 1e-9).all()
            assert (there >= there[-1] - proof - 0.25 - 1e-9).sum() >= 1 and age <= 0.25 + 1e-9
            begun = there[-1]
            for earlier, later in zip(there[::-1][1:], there[::-1][:-1], strict=True):
                if later - earlier > 0.25 + 1e-9:
                    break
                begun = earlier
            assert there[-1] - begun >= proof - 1e-6
        assert found.rearmed[k] == (state[k] == FRESH and before != FRESH)
        if state[k] == FRESH and len(there):
            trusted = there[-1]
        before = state[k]


@pytest.mark.parametrize(("name", "value"), [("level", 0.25), ("land", 1.0)])
def test_times_that_do_not_follow_on_each_other_are_refused(name: str, value: Any) -> None:
    with pytest.raises(ParameterError, match=f"{name} must be above"):
        VisionWatchdog(**{name: value})


FROZEN, BAD_STAMP, CLOCK_RESTARTED, CONTRADICTED = range(4, 8)


def seen(stamp: Any, **more: Any) -> Driven:
    """Drive the watchdog at 20 Hz with a camera of 10 frames/s; its stamps are a function of right ones."""
    times = TICK * np.arange(160)
    right = np.floor(times / FRAME + 1e-9) * FRAME - LATENCY
    stamps = np.array([stamp(time, taken) for time, taken in zip(times, right, strict=True)])
    given = {name: np.where((times >= 3.0) & (times < 6.0), value, 0) for name, value in more.items()}
    if "contradicted" in given:
        given["contradicted"] = given["contradicted"].astype(bool)
    return drive(VisionWatchdog(), stamp=stamps, valid=True, rate="20 Hz", **given)


def check_three_seconds(found: Driven, reason: int) -> None:
    """Check that vision is not FRESH from 0.3 s after 3 s on, for that reason, and is again at the end."""
    assert 3.0 <= entered(found, COAST, 1.0) <= 3.3 + 1e-9
    during = (found.time > 3.35) & (found.time < 4.0)
    assert (found.reason[during] == reason).all()
    assert found.signals["state"][-1] == FRESH and found.reason[-1] == NONE


@pytest.mark.parametrize("wrong", [1000.0, 1e300, math.inf, -math.inf, math.nan])
def test_stamps_that_cannot_be_are_told_from_a_camera_that_is_dead(wrong: float) -> None:
    check_three_seconds(seen(lambda time, right: wrong if 3.0 <= time < 6.0 else right), BAD_STAMP)


@pytest.mark.parametrize("back", [0.3, 1.0, 2.5, 1000.0])
def test_a_clock_that_started_again_is_said_and_trusted_after_its_time_and_its_proof(back: float) -> None:
    found = seen(lambda time, right: right - back if time >= 3.0 else right)
    assert entered(found, COAST, 1.0) <= 3.3
    waiting = (found.time >= 3.35) & (found.time < 3.95)
    assert (found.reason[waiting] == CLOCK_RESTARTED).all()
    assert entered(found, FRESH, 3.35) == pytest.approx(4.5, abs=0.1)
    assert found.age[-1] <= 0.25


def test_a_frozen_camera_has_its_own_reason() -> None:
    found = seen(lambda time, right: min(right, 2.9) if time < 6.0 else right, trouble=FROZEN)
    check_three_seconds(found, FROZEN)


def test_frames_that_contradict_the_inertial_unit_are_not_good_ones() -> None:
    check_three_seconds(seen(lambda time, right: right, contradicted=True), CONTRADICTED)


def test_one_stamp_ahead_does_not_hide_that_the_camera_is_dead() -> None:
    found = seen(lambda time, right: 1000.0 if time == 3.0 else min(right, 2.9))
    assert entered(found, COAST, 1.0) <= 3.3 and (found.stale[found.time > 3.3]).all()
