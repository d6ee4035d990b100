"""Tests of the block math.dot."""

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.math.dot import Dot


def test_it_is_numpy_s_dot_product() -> None:
    a, b = np.random.default_rng(1).normal(size=(2, 40, 5))
    assert drive(Dot(), a=a, b=b).y == pytest.approx(np.einsum("ij,ij->i", a, b), rel=1e-12, abs=1e-12)


def test_scalars_are_vectors_of_one_element() -> None:
    assert drive(Dot(), a=[2.0, 3.0], b=[4.0, -1.0]).y.tolist() == [8.0, -3.0]


def test_unequal_lengths_are_refused() -> None:
    with pytest.raises(TypeError, match="input 'b' has shape"):
        drive(Dot(), a=[[1.0, 2.0]], b=[[1.0, 2.0, 3.0]])
