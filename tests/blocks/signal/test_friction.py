"""Tests of the block signal.friction."""

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.signal.friction import Friction

U = [-2, -0.5, -0.01, 0, 0.01, 0.5, 3]
Y = [-2.3, -1.7, -1.504, 0, 1.504, 1.7, 2.7]


def test_it_has_the_sign_of_the_speed_and_grows_with_it() -> None:
    block = Friction(coulomb=1.5, viscous=0.4)
    assert drive(block, u=U).y == pytest.approx(Y, abs=1e-12)
    assert drive(block, u=[U]).y[0] == pytest.approx(Y, abs=1e-12)


def test_each_element_may_have_a_friction_of_its_own() -> None:
    block = Friction(coulomb=[1.0, 0.0], viscous=[0.0, 2.0])
    assert np.array_equal(drive(block, u=[[3.0, 3.0], [-3.0, -3.0]]).y, [[1.0, 6.0], [-1.0, -6.0]])
