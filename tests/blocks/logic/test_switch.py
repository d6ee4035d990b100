"""Tests of the block logic.switch."""

import numpy as np

from quadvis.testing import drive
from quadvis_blocks.logic.switch import Switch


def test_the_condition_chooses() -> None:
    y = drive(Switch(), condition=[True, False, True], then=[1.0, 2.0, 3.0], otherwise=-1.0).y
    assert y.tolist() == [1.0, -1.0, 3.0]


def test_arrays_are_chosen_whole() -> None:
    y = drive(Switch(), condition=[True, False], then=[[1.0, 2.0]] * 2, otherwise=[[3.0, 4.0]] * 2).y
    assert np.array_equal(y, [[1.0, 2.0], [3.0, 4.0]])
