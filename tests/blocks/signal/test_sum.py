import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.signal.sum import Sum


def test_a_third_term_is_optional() -> None:
    assert drive(Sum(), a=[1.0, 2.0], b=[10.0, 20.0]).y.tolist() == [11.0, 22.0]
    assert drive(Sum(), a=[1.0, 2.0], b=[10.0, 20.0], c=[100.0, 200.0]).y.tolist() == [111.0, 222.0]


def test_arrays_are_added_element_by_element() -> None:
    assert np.array_equal(drive(Sum(), a=[[1.0, 2.0]], b=[[3.0, 5.0]]).y, [[4.0, 7.0]])


def test_a_missing_term_is_refused() -> None:
    with pytest.raises(TypeError, match="Sum needs its input 'b'"):
        drive(Sum(), a=[1.0])
