"""Tests of the block math.atan2."""

import math

import numpy as np

from quadvis.testing import drive
from quadvis_blocks.math.atan2 import Atan2


def test_it_is_the_angle_in_every_quadrant_and_on_the_axes() -> None:
    y = [0.0, 1.0, 1.0, 1.0, 0.0, -1.0, -1.0, -1.0, 0.0]
    x = [1.0, 1.0, 0.0, -1.0, -1.0, -1.0, 0.0, 1.0, 0.0]
    wanted = [math.pi * k / 4 for k in (0, 1, 2, 3, 4, -3, -2, -1)]
    assert drive(Atan2(), y=y, x=x).angle.tolist() == [*wanted, 0.0]


def test_arrays_are_taken_element_by_element() -> None:
    y, x = np.random.default_rng(1).normal(size=(2, 10, 3))
    assert np.allclose(drive(Atan2(), y=y, x=x).angle, np.arctan2(y, x), rtol=1e-14, atol=0)
