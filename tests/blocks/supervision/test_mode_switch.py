import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.mode_switch import ModeSwitch

# A radio channel of 1000 us moves each control over this range, in steps of 1 us.
RANGE = np.array([4.0, 100.0, 100.0, 10.0])
LSB = RANGE / 1000
STEPS, RATE = 12, "20 Hz"

controls = arrays(np.float64, (STEPS, 4), elements=st.floats(-50, 50))
flags = arrays(np.bool_, (STEPS, 4))


def switch(manual: Any, law: Any, automatic: Any, block: ModeSwitch | None = None, **more: Any) -> Driven:
    law = np.asarray(law, float)
    names = {name: law[..., place] for place, name in enumerate(("collective", "roll", "pitch", "yaw"))}
    return drive(
        block or ModeSwitch(),
        manual=manual,
        automatic=automatic,
        rate=RATE,
        **names,
        **{"steps": STEPS, **more},
    )


def changes(flags: np.ndarray) -> np.ndarray:
    """Where a channel changes hands: (ticks - 1, channels)."""
    return flags[1:] != flags[:-1]


@given(controls, controls, flags, st.floats(0.01, 10.0), st.floats(0.01, 10.0))
def test_no_control_jumps_when_it_changes_hands_whatever_the_two_sources_do(
    manual: np.ndarray, law: np.ndarray, automatic: np.ndarray, to_automatic: float, to_manual: float
) -> None:
    block = ModeSwitch(to_automatic=to_automatic, to_manual=to_manual)
    found = switch(manual, law, automatic, block).controls
    assert (np.diff(found, axis=0)[changes(automatic)] == 0.0).all()


@given(controls, controls, flags)
def test_on_the_wires_of_a_radio_no_jump_is_more_than_one_step_of_its_resolution(
    manual: np.ndarray, law: np.ndarray, automatic: np.ndarray
) -> None:
    pulses = np.round(switch(manual, law, automatic).controls / LSB)  # us
    assert (np.abs(np.diff(pulses, axis=0))[changes(automatic)] <= 1).all()


@given(controls, controls, arrays(np.int64, (STEPS, 4), elements=st.integers(0, 3)), flags)
def test_nor_does_it_jump_when_neutral_comes_and_goes_or_when_idle_goes(
    manual: np.ndarray, law: np.ndarray, owner: np.ndarray, neutral: np.ndarray
) -> None:
    result = switch(manual, law, owner == 1, neutral=owner == 2, idle=(owner == 3).all(axis=1))
    assert (np.diff(result.controls, axis=0)[changes(result.source) & (result.source[1:] < 3)] == 0.0).all()
    assert (result.controls[result.source == 3] == 0.0).all()


@pytest.mark.parametrize(("automatic", "constant"), [([False] * 4, 0.2), ([True] * 4, 0.5)])
def test_the_difference_from_the_new_source_decays_with_its_time_constant(
    automatic: list[bool], constant: float
) -> None:
    series = np.array([np.logical_not(automatic)] + [automatic] * (STEPS - 1))
    manual, law = np.array([5.0, 1.0, -1.0, 0.0]), np.array([4.0, 3.0, 2.0, 1.0])
    new, old = (law, manual) if automatic[0] else (manual, law)
    found = switch(manual, law, series).controls
    elapsed = 0.05 * np.arange(STEPS - 1)[:, None]
    assert found[1:] == pytest.approx(new + (old - new) * np.exp(-elapsed / constant))


def test_what_the_pilot_does_after_taking_over_passes_through_at_once() -> None:
    stick = np.linspace(0.0, 11.0, STEPS) ** 2
    manual = np.stack([stick] * 4, axis=1)
    series = np.array([[True] * 4] + [[False] * 4] * (STEPS - 1))
    found = switch(manual, [3.0] * 4, series, ModeSwitch(to_manual=1e9)).controls
    assert np.diff(found[1:], axis=0) == pytest.approx(np.diff(manual[1:], axis=0))


def test_with_no_time_constant_the_stick_counts_at_once_as_it_stands() -> None:
    series = np.array([[True] * 4] * 3 + [[False] * 4] * (STEPS - 3))
    found = switch([1.0, 2.0, 3.0, 4.0], [0.0] * 4, series, ModeSwitch(to_manual=0.0))
    assert (found.controls[:3] == 0.0).all()
    assert (found.controls[3:] == [1.0, 2.0, 3.0, 4.0]).all()


def test_each_channel_has_a_switch_of_its_own() -> None:
    found = switch([1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [True, False, True, False])
    assert (found.controls == [5.0, 2.0, 7.0, 4.0]).all()
    assert (found.source == [1, 0, 1, 0]).all()


def test_neutral_carries_the_weight_and_idle_nothing() -> None:
    neutral = switch([9.0] * 4, [8.0] * 4, [True] * 4, neutral=[True] * 4)
    assert (neutral.controls == [4.905, 0.0, 0.0, 0.0]).all() and (neutral.source == 2).all()
    idle = switch([9.0] * 4, [8.0] * 4, [True] * 4, neutral=[True] * 4, idle=True)
    assert (idle.controls == 0.0).all() and (idle.source == 3).all()


def test_a_bare_switch_at_one_metre_would_jump_by_what_the_law_wants() -> None:
    # y 1 m, v .3 m/s, phi 3 deg at lambda 2: 1.6 rad/s^2 of bare engagement jump.
    law = [4.905, -1.6, 0.0, 0.0]
    series = np.array([[False] * 4] + [[True] * 4] * (STEPS - 1))
    bare = switch([4.905, 0.0, 0.0, 0.0], law, series, ModeSwitch(to_automatic=0.0)).controls[:, 1]
    bumpless = switch([4.905, 0.0, 0.0, 0.0], law, series).controls[:, 1]
    assert np.abs(np.diff(bare)).max() == 1.6
    assert np.abs(np.diff(bumpless)).max() == pytest.approx(1.6 * -math.expm1(-0.05 / 0.5))


def test_controls_carry_the_time_at_which_they_were_made() -> None:
    found = switch(np.zeros((STEPS, 4)), np.zeros(4), np.ones((STEPS, 4), bool))
    assert found.stamp == pytest.approx(found.time)
