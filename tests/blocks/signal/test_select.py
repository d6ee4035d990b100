"""Tests of the block signal.select."""

import numpy as np
import pytest

from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.signal.select import Select

U = [[10.0, 20.0, 30.0]] * 3


def test_an_index_takes_an_element() -> None:
    assert drive(Select(), index=np.array([0, 2, 1]), u=U).y.tolist() == [10.0, 30.0, 20.0]


def test_several_indices_take_several_elements() -> None:
    y = drive(Select(), index=np.array([[0, 2], [2, 2], [1, 0]]), u=U).y
    assert np.array_equal(y, [[10, 30], [30, 30], [20, 10]])


def test_beyond_the_vector_the_nearest_element_counts_or_the_run_ends() -> None:
    assert drive(Select(), index=np.array([-1, 3, 9]), u=U).y.tolist() == [10.0, 30.0, 30.0]
    with pytest.raises(RunError, match=r"no element of the vector.*\(index = 3\)"):
        drive(Select(outside="refuse"), index=np.array([0, 3, 1]), u=U)
