"""Tests of the block signal.concatenate."""

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.signal.concatenate import Concatenate


def test_scalars_become_the_elements_of_a_vector() -> None:
    assert np.array_equal(drive(Concatenate(), u=[[1.0, 2.0], 3.0, -4.0]).y, [[1, 3, -4], [2, 3, -4]])


def test_scalars_and_vectors_follow_each_other_as_numpy_has_it() -> None:
    rng = np.random.default_rng(2)
    a, b, c = rng.normal(size=(5, 3)), rng.normal(size=5), rng.normal(size=(5, 2))
    wanted = np.concatenate((a, b[:, None], c), axis=1)
    assert np.array_equal(drive(Concatenate(), u=[a, b, c]).y, wanted)


def test_one_signal_becomes_a_vector() -> None:
    assert np.array_equal(drive(Concatenate(), u=[[5.0, 6.0]]).y, [[5.0], [6.0]])


def test_a_matrix_is_refused() -> None:
    with pytest.raises(TypeError, match=r"input 'u\[1\]' has shape \(1, 2, 2\)"):
        drive(Concatenate(), u=[[1.0], np.zeros((1, 2, 2))])
