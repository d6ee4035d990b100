import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.signal.difference import Difference


def test_a_difference_is_plus_less_minus() -> None:
    assert drive(Difference(), plus=[5.0, 1.0], minus=[2.0, 4.0]).y.tolist() == [3.0, -3.0]
    assert np.array_equal(drive(Difference(), plus=[[1.0, 2.0]], minus=[[3.0, 5.0]]).y, [[-2.0, -3.0]])


def test_a_missing_term_is_refused() -> None:
    with pytest.raises(TypeError, match="Difference needs its input 'minus'"):
        drive(Difference(), plus=[1.0])
