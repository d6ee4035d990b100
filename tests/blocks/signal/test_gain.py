import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.gain import Gain


def test_a_gain_multiplies_each_element() -> None:
    assert drive(Gain(factor=-2.0), u=[0.0, 1.5, -3.0]).y.tolist() == [0.0, -3.0, 6.0]
    assert np.array_equal(drive(Gain(factor=3.0), u=[[1.0, 2.0], [0.0, -1.0]]).y, [[3.0, 6.0], [0.0, -3.0]])


def test_a_factor_that_is_no_number_is_refused() -> None:
    with pytest.raises(ParameterError, match="factor must be a number or an array of numbers in b/a"):
        Gain(factor="much")


def test_each_element_may_have_a_factor_of_its_own() -> None:
    assert np.array_equal(drive(Gain(factor=[2.0, -1.0]), u=[[1.0, 2.0], [0.5, 3.0]]).y, [[2, -2], [1, -3]])
    with pytest.raises(TypeError, match="input 'u' has shape"):
        drive(Gain(factor=[2.0, -1.0]), u=[[1.0, 2.0, 3.0]])
