from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.failsafe import Failsafe

FRESH, COAST, LEVEL, LOST = range(4)
MANUAL, MIXED, AUTOMATIC, COASTING, LEVELLED, LANDING = range(6)
NONE, SWITCH, STICK, IMU_STALE, STICKS_STALE, NO_FRAMES, TARGET_LOST, REARMING, ASKED, SATURATED = range(10)
ALL, NOBODY = [True] * 4, [False] * 4
PER_CHANNEL = ("automatic", "overridden", "limited")


def fly(block: Failsafe | None = None, **inputs: Any) -> Driven:
    """Drive at 20 Hz, three steps if no input is a series; all switches are on unless said otherwise."""
    series = any(np.ndim(value) > (name in PER_CHANNEL) for name, value in inputs.items())
    steps = None if series else 3
    return drive(block or Failsafe(), rate="20 Hz", steps=steps, **{"automatic": ALL, **inputs})


@pytest.mark.parametrize(
    ("inputs", "mode", "reason"),
    [
        ({}, AUTOMATIC, NONE),
        ({"automatic": NOBODY}, MANUAL, SWITCH),
        ({"automatic": [True, False, True, True]}, MIXED, SWITCH),
        ({"automatic": [True, False, True, True], "overridden": [False, True, False, False]}, MIXED, STICK),
        ({"vision": COAST, "vision_reason": 1, "vision_stale": True}, COASTING, NO_FRAMES),
        ({"vision": COAST, "vision_reason": 2, "vision_stale": True}, COASTING, TARGET_LOST),
        ({"vision": COAST, "vision_reason": 3}, COASTING, REARMING),
        ({"vision": LEVEL, "vision_reason": 1, "vision_stale": True}, LEVELLED, NO_FRAMES),
        ({"vision": LOST, "vision_reason": 2, "vision_stale": True}, LANDING, TARGET_LOST),
        ({"land": 1.0}, LANDING, ASKED),
        ({"imu_stale": True}, MIXED, IMU_STALE),
        ({"imu_stale": True, "vision": COAST, "vision_reason": 1, "vision_stale": True}, COASTING, IMU_STALE),
        ({"sticks_stale": True}, AUTOMATIC, STICKS_STALE),
        ({"limited": [False, False, False, True]}, AUTOMATIC, SATURATED),
        ({"automatic": NOBODY, "vision": LOST, "vision_reason": 1, "vision_stale": True}, MANUAL, SWITCH),
    ],
)  # fmt: skip
def test_each_situation_has_its_mode_and_its_reason(inputs: dict[str, Any], mode: int, reason: int) -> None:
    found = fly(**inputs)
    assert (found.mode == mode).all() and (found.reason == reason).all()


def test_without_an_imu_roll_and_pitch_are_nobodys_and_the_rest_goes_on() -> None:
    found = fly(imu_stale=[False, True, True, False])
    assert found.allowed.tolist() == [ALL, [True, False, False, True], [True, False, False, True], ALL]
    assert (found.neutral == ~found.allowed).all()


def test_a_craft_that_levels_itself_may_leave_them_to_the_pilot_if_he_is_there() -> None:
    found = fly(Failsafe(imu_lost="pilot"), imu_stale=[True, True], sticks_stale=[False, True])
    assert not found.allowed[:, 1:3].any()
    assert found.neutral.tolist() == [NOBODY, [False, True, True, False]]


def test_sticks_that_are_stale_do_not_stop_the_law() -> None:
    assert fly(sticks_stale=True).allowed.all()


def test_velocities_stop_counting_at_once_when_frames_are_stale_and_positions_stay() -> None:
    stale = [False, True, True, False]
    found = fly(vision=[FRESH, COAST, COAST, COAST], vision_stale=stale, vision_reason=[0, 1, 1, 3])
    assert found.velocity_weight.tolist() == [1.0, 0.0, 0.0, 1.0]
    assert (found.position_weight == 1.0).all()
    kept = fly(Failsafe(coast_velocity="keep"), vision=[COAST] * 4, vision_stale=stale)
    assert (kept.velocity_weight == 1.0).all()


def test_positions_go_and_come_back_over_a_second() -> None:
    vision = [FRESH] + [LEVEL] * 30 + [FRESH] * 30
    found = fly(vision=vision, vision_stale=[state == LEVEL for state in vision])
    ramp = np.minimum(np.arange(1, 31) / 20, 1.0)
    assert found.position_weight[1:31] == pytest.approx(1.0 - ramp)
    assert found.position_weight[31:] == pytest.approx(ramp)
    assert (found.velocity_weight[1:31] == 0.0).all()
    assert found.velocity_weight[31:] == pytest.approx(ramp)


def test_a_landing_goes_on_when_vision_comes_back_and_ends_when_the_pilot_takes_the_collective() -> None:
    vision = [FRESH, LOST, FRESH, FRESH, FRESH]
    automatic = [ALL, ALL, ALL, [False, True, True, True], ALL]
    found = fly(vision=vision, vision_reason=[0, 1, 0, 0, 0], automatic=automatic)
    assert found.descend.tolist() == [False, True, True, False, False]
    assert found.reason[2] == NO_FRAMES


def test_a_landing_that_was_asked_for_goes_on_when_the_switch_goes_back() -> None:
    assert fly(land=[0.0, 1.0, 0.0]).descend.tolist() == [False, True, True]


def test_vision_given_up_may_hand_all_to_the_pilot_until_he_has_switched_off_and_on() -> None:
    vision = [FRESH, LOST, FRESH, FRESH, FRESH]
    automatic = [ALL, ALL, ALL, NOBODY, ALL]
    found = fly(Failsafe(on_loss="manual"), vision=vision, vision_reason=[0, 1, 0, 0, 0], automatic=automatic)
    assert found.allowed.all(axis=1).tolist() == [True, False, False, False, True]
    assert not found.descend.any()
    assert found.reason[1] == NO_FRAMES and found.mode[1] == MANUAL


def test_but_not_to_a_pilot_who_is_not_there() -> None:
    found = fly(Failsafe(on_loss="manual"), vision=LOST, vision_reason=1, sticks_stale=True)
    assert found.allowed.all() and found.descend.all()


def test_nor_to_one_whose_radio_fails_after_he_has_taken_over() -> None:
    block, stale = Failsafe(on_loss="manual"), [False, True, True, False]
    found = fly(block, vision=[LOST] * 4, vision_reason=1, sticks_stale=stale)
    assert found.allowed.all(axis=1).tolist() == [False, True, True, False]
    assert found.descend.tolist() == [False, True, True, False]


def test_channels_are_engaged_at_the_tick_at_which_the_law_gets_them() -> None:
    automatic = [ALL, NOBODY, [False, True, False, False], ALL, ALL]
    imu_stale = [False, False, False, False, True]
    found = fly(automatic=automatic, imu_stale=imu_stale)
    assert found.engaged.tolist() == [
        NOBODY, NOBODY, [False, True, False, False], [True, False, True, True], NOBODY
    ]  # fmt: skip


@given(st.lists(st.booleans(), min_size=4, max_size=4), st.lists(st.booleans(), min_size=4, max_size=4))
def test_integrators_freeze_where_the_law_is_not_or_does_not_get_what_it_wants(
    automatic: list[bool], limited: list[bool]
) -> None:
    found = fly(automatic=automatic, limited=limited)
    assert (found.freeze == [gave or not law for law, gave in zip(automatic, limited, strict=True)]).all()


situations = st.lists(
    st.tuples(
        st.integers(0, 3),
        st.booleans(),
        st.booleans(),
        st.booleans(),
        st.booleans(),
        st.sampled_from([0.0, 1.0]),
    ),
    min_size=2,
    max_size=40,
)


@given(situations, st.sampled_from(["land", "manual"]), st.sampled_from(["neutral", "pilot"]))
def test_whatever_happens_the_law_never_has_what_the_pilot_or_a_dead_imu_denies(
    situations: list[tuple[int, bool, bool, bool, bool, float]], on_loss: str, imu_lost: str
) -> None:
    vision, stale, imu_stale, sticks_stale, on, land = (
        np.array(column) for column in zip(*situations, strict=True)
    )
    automatic = np.repeat(on[:, None], 4, axis=1)
    found = fly(
        Failsafe(on_loss=on_loss, imu_lost=imu_lost), automatic=automatic, vision=vision, vision_stale=stale,
        imu_stale=imu_stale, sticks_stale=sticks_stale, land=land,
    )  # fmt: skip
    assert not (found.allowed & ~automatic).any()
    assert not (found.allowed & found.neutral).any()
    assert not found.allowed[imu_stale, 1:3].any()
    assert not (found.descend & ~found.allowed[:, 0]).any()
    assert (found.velocity_weight <= found.position_weight).all()
    assert (np.abs(np.diff(found.position_weight)) <= 0.05 + 1e-12).all()
    assert not found.velocity_weight[stale | (vision >= LEVEL)].any()
