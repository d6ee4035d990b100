"""Tests of the block signal.dead_zone."""

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.dead_zone import DeadZone

U = [-2.0, -1.0, -0.9, -0.4, 0.0, 0.5, 0.6, 2.0]
Y = [-1.1, -0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 1.5]


def test_what_is_beyond_the_zone_passes() -> None:
    assert drive(DeadZone(lower=-0.9, upper=0.5), u=U).y == pytest.approx(Y, abs=1e-12)
    assert drive(DeadZone(lower=-0.9, upper=0.5), u=[U]).y[0] == pytest.approx(Y, abs=1e-12)


def test_a_zone_of_no_width_changes_nothing_to_the_bit() -> None:
    u = np.random.default_rng(1).normal(size=100)
    assert np.array_equal(drive(DeadZone(lower=0.0, upper=0.0), u=u).y, u)


def test_each_element_may_have_a_zone_of_its_own() -> None:
    block = DeadZone(lower=[-1.0, 0.0], upper=[1.0, 0.0])
    assert np.array_equal(drive(block, u=[[3.0, 3.0], [-0.5, -0.5]]).y, [[2.0, 3.0], [0.0, -0.5]])


def test_a_zone_the_wrong_way_round_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"lower must be at most upper, 0\.5, got 1"):
        DeadZone(lower=1.0)
