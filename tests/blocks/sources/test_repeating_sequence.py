"""Tests of the block sources.repeating_sequence."""

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.repeating_sequence import RepeatingSequence

TIMES, VALUES = [0.0, 0.3, 0.4], [0.0, 3.0, 0.0]


def test_it_moves_in_straight_lines_again_and_again() -> None:
    driven = drive(RepeatingSequence(times=TIMES, values=VALUES), rate="20 Hz", steps=400)
    wanted = np.interp(np.round(driven.time % 0.4, 9) % 0.4, TIMES, VALUES)
    assert driven.y == pytest.approx(wanted, abs=1e-9)


def test_it_holds_its_values() -> None:
    block = RepeatingSequence(times=TIMES, values=[1.0, 2.0, 9.0], interpolation="hold")
    assert drive(block, rate="10 Hz", steps=9).y.tolist() == [1, 1, 1, 2, 1, 1, 1, 2, 1]


def test_it_begins_where_it_is_told() -> None:
    block = RepeatingSequence(times=TIMES, values=VALUES, begin=0.1)
    assert drive(block, rate="10 Hz", steps=5).y == pytest.approx([3.0, 0.0, 1.0, 2.0, 3.0], abs=1e-9)


@pytest.mark.parametrize(
    ("times", "problem"),
    [
        ([0.1, 0.3, 0.4], "times must begin with 0 s"),
        ([0.0, 0.4, 0.4], r"times must rise; \[2\] is 0\.4, after 0\.4"),
    ],
)
def test_instants_that_make_no_period_are_refused(times: list[float], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        RepeatingSequence(times=times, values=VALUES)
