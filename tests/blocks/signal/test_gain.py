import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.gain import Gain


def test_a_gain_multiplies_each_element() -> None:
    assert drive(Gain(factor=-2.0), u=[0.0, 1.5, -3.0]).y.tolist() == [0.0, -3.0, 6.0]
    assert np.array_equal(drive(Gain(factor=3.0), u=[[1.0, 2.0], [0.0, -1.0]]).y, [[3.0, 6.0], [0.0, -3.0]])


def test_a_factor_that_is_no_number_is_refused() -> None:
    with pytest.raises(ParameterError, match="factor must be a number"):
        Gain(factor=[1.0, 2.0])
