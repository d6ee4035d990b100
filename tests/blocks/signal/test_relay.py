"""Tests of the block signal.relay."""

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.relay import Relay

U = [0, 0.25, 0.5, 0.4, 0, -0.25, -0.5, -0.4, 0.4999, 0.5, 0.6, -0.5]
Y = [-1, -1, 2, 2, 2, 2, -1, -1, -1, 2, 2, -1]


def test_it_keeps_its_state_between_the_thresholds() -> None:
    block = Relay(on_at=0.5, off_at=-0.5, on_value=2.0, off_value=-1.0)
    assert drive(block, u=U).y.tolist() == Y
    both = np.column_stack([U, np.negative(U)])
    assert drive(block, u=both).y[:, 0].tolist() == Y


def test_it_is_one_of_its_two_values_from_the_first_tick_on() -> None:
    assert drive(Relay(on_value=1.0, off_value=-1.0), u=[0.0, 0.0]).y.tolist() == [-1.0, -1.0]
    assert drive(Relay(on_value=1.0, off_value=-1.0, initial="on"), u=[0.0, 0.0]).y.tolist() == [1.0, 1.0]


def test_a_start_beyond_a_threshold_overrides_the_initial_state_at_once() -> None:
    assert drive(Relay(on_value=1.0, off_value=-1.0), u=[7.0, 0.0]).y.tolist() == [1.0, 1.0]
    assert drive(Relay(on_value=1.0, off_value=-1.0, initial="on"), u=[-7.0, 0.0]).y.tolist() == [-1.0, -1.0]


def test_each_element_has_thresholds_values_and_a_state_of_its_own() -> None:
    block = Relay(on_at=[1.0, 2.0], off_at=0.0, on_value=[5.0, 6.0], off_value=0.0)
    assert np.array_equal(drive(block, u=[[1.5, 1.5], [0.5, 2.0], [0.0, 1.0]]).y, [[5, 0], [5, 6], [0, 6]])


def test_thresholds_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"off_at must be at most on_at, 0\.5, got 1"):
        Relay(off_at=1.0)
