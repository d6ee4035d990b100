import math
from typing import Any

import numpy as np
import pytest

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.pose_gate import PoseGate

NONE, REARMING, FROZEN, CONTRADICTED = 0, 3, 4, 7
TIMES = 0.1 * np.arange(100)
FAULT = (TIMES >= 3.0) & (TIMES < 6.0)
PROOF = (TIMES >= 3.0) & (TIMES < 6.15)  # and the two frames after it, until three agree


def gate(position: Any = None, yaw: Any = 0.0, yaw_rate: Any = 0.0, **more: Any) -> Driven:
    position = np.zeros((100, 3)) if position is None else position
    yaw = np.broadcast_to(yaw, 100)
    more = {"stamp": TIMES, **more}
    return drive(PoseGate(), position=position, yaw=yaw, yaw_rate=yaw_rate, rate="10 Hz", **more)


def test_a_craft_at_rest_passes() -> None:
    found = gate()
    assert found.plausible.all() and (found.reason == NONE).all()


@pytest.mark.parametrize("turn", [180.0, 90.0, -90.0, 60.0, -150.0])
def test_a_picture_that_is_turned_is_refused_for_three_seconds(turn: float) -> None:
    found = gate(yaw=np.where(FAULT, math.radians(turn), 0.0))
    assert np.array_equal(found.plausible, ~PROOF)
    assert ((found.reason == CONTRADICTED) == PROOF).all()


def test_a_turn_that_the_gyro_sees_too_passes_also_over_half_a_turn() -> None:
    rate = np.where(FAULT, 2.0, 0.0)
    yaw = np.concatenate(([0.0], np.cumsum(rate)[:-1] * 0.1))
    assert gate(yaw=np.angle(np.exp(1j * yaw)), yaw_rate=rate).plausible.all()


@pytest.mark.parametrize("jump", [[3.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 1.5], [50.0, 0.0, 0.0]])
def test_a_position_out_of_reach_is_refused_until_the_craft_can_be_there(jump: list[float]) -> None:
    found = gate(np.where(FAULT[:, None], jump, 0.0))
    assert not found.plausible[30] and found.plausible[:30].all()
    since = np.maximum(TIMES - 2.9, 0.0)
    reach = 0.25 + 2.0 * since + 2.5 * since**2
    first = np.argmax(reach >= np.linalg.norm(jump))
    assert found.plausible[30:60].tolist() == [k >= first + 2 for k in range(30, 60)]


@pytest.mark.parametrize("seed", range(10))
def test_random_poses_of_which_some_are_in_reach_are_refused(seed: int) -> None:
    noise = np.random.default_rng(seed).normal(0.0, 2.0, (100, 3))
    found = gate(np.where(FAULT[:, None], noise, 0.0))
    assert found.plausible[30:60].sum() <= 2
    assert found.plausible[:30].all() and found.plausible[63:].all()


def test_one_wrong_pose_costs_itself_and_two_more() -> None:
    found = gate(np.where((np.arange(100) == 40)[:, None], [5.0, 0.0, 0.0], 0.0))
    assert np.flatnonzero(~found.plausible).tolist() == [40, 41, 42]


def test_a_fast_craft_is_not_refused() -> None:
    assert gate(np.column_stack((4.0 * TIMES, -2.0 * TIMES, 0.0 * TIMES))).plausible.all()


def test_after_long_darkness_any_pose_counts_once_two_more_agree() -> None:
    dark = (TIMES > 1.0) & (TIMES < 9.0)
    yaw = np.where(TIMES > 5.0, math.radians(80.0), 0.0)
    found = gate(np.where(TIMES[:, None] > 5.0, [9.0, 0.0, 0.0], 0.0), yaw, valid=~dark)
    waits = np.isin(np.arange(100), [90, 91])
    assert np.array_equal(found.plausible, ~dark & ~waits)
    assert np.array_equal(found.reason == REARMING, waits) and not (found.reason == CONTRADICTED).any()


@pytest.mark.parametrize("lost", [1, 2])
def test_few_frames_without_a_pose_cast_no_doubt(lost: int) -> None:
    valid = (np.arange(100) < 40) | (np.arange(100) >= 40 + lost)
    assert np.array_equal(gate(valid=valid).plausible, valid)


def test_frames_that_do_not_come_cast_no_doubt() -> None:
    """The stamp stands still for 3 s, then frames go on."""
    stamps = np.where(FAULT, 2.9, TIMES)
    assert gate(stamp=stamps).plausible.all()


def test_one_pose_among_frames_without_any_never_counts() -> None:
    """Noise that looks like the target once: 1.2 m lower, which is in reach by then."""
    lucky = np.arange(100) == 55
    found = gate(np.where(lucky[:, None], [0.0, 0.0, -1.2], 0.0), valid=~FAULT | lucky)
    assert not found.plausible[30:62].any() and found.plausible[62:].all()
    assert found.reason[55] == REARMING


def test_what_gave_no_pose_is_not_plausible_and_no_contradiction() -> None:
    found = gate(
        np.where(FAULT[:, None], np.full(3, math.nan), 0.0), np.where(FAULT, math.nan, 0.0), valid=~FAULT
    )
    waits = np.isin(np.arange(100), [60, 61])
    assert np.array_equal(found.plausible, ~FAULT & ~waits)
    assert np.array_equal(found.reason == REARMING, waits) and (found.reason[~waits] == NONE).all()


def test_the_verdict_holds_until_the_next_frame_and_trouble_is_handed_on() -> None:
    stamp = np.where(FAULT, TIMES[29], TIMES)
    found = gate(
        np.where(FAULT[:, None], [9.0, 0.0, 0.0], 0.0), stamp=stamp, trouble=np.where(FAULT, FROZEN, 0)
    )
    assert found.plausible.all() and np.array_equal(found.reason, np.where(FAULT, FROZEN, NONE))
