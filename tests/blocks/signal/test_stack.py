import numpy as np

from quadvis.testing import drive
from quadvis_blocks.signal.stack import Stack


def test_scalars_become_the_elements_of_a_vector() -> None:
    assert np.array_equal(drive(Stack(), a=[1.0, 2.0], b=3.0, c=-4.0).y, [[1, 3, -4], [2, 3, -4]])


def test_what_is_not_given_is_zero() -> None:
    assert np.array_equal(drive(Stack(), a=[1.0]).y, [[1, 0, 0]])
