import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.saturation import Saturation


def test_values_between_the_limits_pass_and_others_stop_at_them() -> None:
    block = Saturation(lower=-1.0, upper=0.5)
    assert drive(block, u=[-2.0, -1.0, 0.2, 0.5, 9.0]).y.tolist() == [-1.0, -1.0, 0.2, 0.5, 0.5]


def test_arrays_are_limited_element_by_element() -> None:
    assert np.array_equal(drive(Saturation(), u=[[-3.0, 0.3, 3.0]]).y, [[-1.0, 0.3, 1.0]])


def test_each_element_may_have_limits_of_its_own() -> None:
    block = Saturation(lower=[-1.0, -5.0, 0.0], upper=2.0)
    assert np.array_equal(drive(block, u=[[-3.0, -3.0, -3.0], [9.0, 1.0, 1.0]]).y, [[-1, -3, 0], [2, 1, 1]])
    with pytest.raises(ParameterError, match="lower must be at most upper, 2, got 3"):
        Saturation(lower=[1.0, 3.0], upper=[4.0, 2.0])


def test_limits_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ParameterError, match="lower must be at most upper, 1, got 2"):
        Saturation(lower=2.0)
