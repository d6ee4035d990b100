"""Tests of the block math.cross."""

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.math.cross import Cross


def test_it_is_numpy_s_cross_product() -> None:
    a, b = np.random.default_rng(1).normal(size=(2, 40, 3))
    assert drive(Cross(), a=a, b=b).y == pytest.approx(np.cross(a, b), rel=1e-12, abs=1e-12)


def test_x_and_y_give_z() -> None:
    assert drive(Cross(), a=[1.0, 0.0, 0.0], b=[[0.0, 1.0, 0.0]], steps=1).y.tolist() == [[0.0, 0.0, 1.0]]
