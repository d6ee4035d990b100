from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.stick_override import StickOverride

ROLL = 1


def fly(roll: Any, switch: Any = None, block: StickOverride | None = None, **more: Any) -> Driven:
    """Move the roll stick and its switch; the other switches are on, their sticks in the middle."""
    sticks = np.zeros((len(roll), 4))
    sticks[:, ROLL] = roll
    switches = np.ones((len(roll), 4))
    switches[:, ROLL] = 1.0 if switch is None else switch
    return drive(block or StickOverride(), sticks=sticks, switches=switches, **more)


def test_a_stick_beyond_thirty_percent_takes_its_channel_and_no_other() -> None:
    found = fly([0.0, 0.29, 0.31, 0.31])
    assert found.automatic[:, ROLL].tolist() == [True, True, False, False]
    assert found.overridden[:, ROLL].tolist() == [False, False, True, True]
    assert found.automatic[:, [0, 2, 3]].all()


def test_the_channel_stays_with_the_pilot_until_the_switch_has_been_off() -> None:
    found = fly([0.0, -0.5, 0.0, 0.0, 0.0, 0.0], [1, 1, 1, 1, 0, 1])
    assert found.automatic[:, ROLL].tolist() == [True, False, False, False, False, True]
    assert found.overridden[:, ROLL].tolist() == [False, True, True, True, False, False]


def test_the_deflection_counts_from_where_the_stick_stood_when_the_switch_came_on() -> None:
    found = fly([0.5, 0.5, 0.75, 0.1], [0, 1, 1, 1])
    assert found.automatic[:, ROLL].tolist() == [False, True, True, False]


def test_or_from_neutral_and_then_a_deflected_stick_does_not_let_its_channel_go() -> None:
    block = StickOverride(origin="neutral")
    found = fly([0.25, 0.25, 0.0, 0.0, 0.15, 0.28, 0.31], [0, 1, 1, 0, 1, 1, 1], block)
    assert found.automatic[:, ROLL].tolist() == [False, False, False, False, True, True, False]


def test_one_stick_takes_back_all_if_they_go_together() -> None:
    found = fly([0.0, 0.4, 0.0], block=StickOverride(together=True))
    assert found.automatic.all(axis=1).tolist() == [True, False, False]
    assert not found.automatic[1:].any()


def test_a_link_that_fails_does_not_look_like_a_pilot_who_moves() -> None:
    stale = [False, False, True, True, False]
    found = fly([0.5, 0.5, 0.0, 0.0, 0.5], [1, 1, 0, 0, 1], stale=stale)
    assert found.automatic.all()


def test_noise_about_the_middle_of_a_switch_does_not_make_it_chatter() -> None:
    found = fly([0.0] * 6, [0.55, 0.7, 0.5, 0.45, 0.55, 0.3])
    assert found.automatic[:, ROLL].tolist() == [False, True, True, True, True, False]


steps = st.lists(st.tuples(st.floats(-1, 1), st.booleans()), min_size=2, max_size=40)


@given(steps, st.floats(0.2, 0.9))
def test_a_channel_is_automatic_exactly_while_the_stick_stayed_near_since_the_switch_came_on(
    steps: list[tuple[float, bool]], threshold: float
) -> None:
    roll = [stick for stick, _ in steps]
    switch = [float(on) for _, on in steps]
    found = fly(roll, switch, StickOverride(threshold=threshold))
    for k in range(len(steps)):
        since = k
        while since > 0 and switch[since - 1]:
            since -= 1
        near = all(abs(roll[j] - roll[since]) <= threshold for j in range(since, k + 1))
        assert found.automatic[k, ROLL] == (bool(switch[k]) and near)


def test_a_release_beyond_the_threshold_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"release must be at most the threshold, 0\.3, got 0\.4"):
        StickOverride(release=0.4)
