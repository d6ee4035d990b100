import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis_blocks.supervision.output_hold import OutputHold


def test_a_good_command_passes_and_the_last_one_is_held_for_a_quarter_of_a_second() -> None:
    valid = [True] + [False] * 7
    found = drive(OutputHold(safe=-1.0), u=[3.0] + [9.0] * 7, valid=valid, rate="20 Hz")
    assert found.y.tolist() == [3.0] * 6 + [-1.0] * 2
    assert found.stale.tolist() == [False] * 6 + [True] * 2


def test_a_sender_that_repeats_its_last_message_is_dead() -> None:
    found = drive(OutputHold(), u=[[1.0, 2.0]] * 4, stamp=[0.0] * 4, rate="10 Hz")
    assert found.y.tolist() == [[1.0, 2.0]] * 3 + [[0.0, 0.0]]


def test_before_the_first_good_command_the_output_is_safe() -> None:
    found = drive(OutputHold(safe=0.5), u=[math.nan, math.inf, 2.0], rate="10 Hz")
    assert found.y.tolist() == [0.5, 0.5, 2.0]
    assert found.stale.tolist() == [True, True, False]


def test_sticks_are_neutral_half_a_second_after_the_link_is_lost() -> None:
    sticks = [[0.1, 0.5, -0.5, 0.0]] * 12
    found = drive(OutputHold(max_age=0.5), u=sticks, stamp=[0.0] * 12, rate="20 Hz")
    assert (found.y[:11] == sticks[0]).all() and (found.y[11] == 0.0).all()


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.floats(0.0, 1.0))
def test_no_command_outlives_its_age(valid: list[bool], max_age: float) -> None:
    commands = [float(k + 1) for k in range(len(valid))]
    found = drive(OutputHold(max_age=max_age), u=commands, valid=valid, rate="20 Hz")
    for k, y in enumerate(found.y):
        good = [j for j in range(k + 1) if valid[j]]
        young = good and (k - good[-1]) * 0.05 <= max_age + 1e-9
        assert y == (pytest.approx(commands[good[-1]]) if young else 0.0)
        assert found.stale[k] == (not young)
