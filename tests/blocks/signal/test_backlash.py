"""Tests of the block signal.backlash."""

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.backlash import Backlash

U = [0, 0.2, 0.6, 1, 0.9, 0.5, 0.1, -0.4, -0.4, 0, 0.5, 0.75]
Y = [0.0, 0.0, 0.2, 0.6, 0.6, 0.6, 0.5, 0.0, 0.0, 0.0, 0.1, 0.35]


def test_the_output_moves_only_where_it_is_pushed() -> None:
    assert drive(Backlash(width=0.8), u=U).y == pytest.approx(Y, abs=1e-12)
    found = drive(Backlash(width=[0.8, 0.0]), u=np.column_stack([U, U])).y
    assert found[:, 0] == pytest.approx(Y, abs=1e-12) and found[:, 1].tolist() == U


def test_it_begins_at_its_initial_output_as_far_as_the_input_lets_it() -> None:
    assert drive(Backlash(width=2.0, initial=0.5), u=[0.0]).y.tolist() == [0.5]
    assert drive(Backlash(width=2.0, initial=5.0), u=[0.0]).y.tolist() == [1.0]


def test_a_negative_play_is_refused() -> None:
    with pytest.raises(ParameterError, match="width must be at least 0"):
        Backlash(width=-1.0)
