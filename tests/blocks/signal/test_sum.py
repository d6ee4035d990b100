"""Tests of the block signal.sum."""

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.sum import Sum


def test_any_number_of_terms_is_added() -> None:
    assert drive(Sum(), u=[[1.0, 2.0]]).y.tolist() == [1.0, 2.0]
    assert drive(Sum(), u=[[1.0, 2.0], [10.0, 20.0]]).y.tolist() == [11.0, 22.0]
    assert drive(Sum(), u=[[1.0, 2.0], [10.0, 20.0], 100.0, [0.5, 0.25]]).y.tolist() == [111.5, 122.25]


def test_signs_say_which_terms_are_subtracted() -> None:
    assert drive(Sum(signs="+-+"), u=[[1.0], [10.0], [100.0]]).y.tolist() == [91.0]
    assert drive(Sum(signs="-+"), u=[[1.0], [10.0]]).y.tolist() == [9.0]
    assert drive(Sum(signs="-"), u=[[[1.0, -2.0]]]).y.tolist() == [[-1.0, 2.0]]


def test_terms_are_added_in_their_order_to_the_bit() -> None:
    rng = np.random.default_rng(1)
    a, b, c = rng.normal(size=(3, 100)) * [[1.0], [1e8], [1e-8]]
    assert np.array_equal(drive(Sum(signs="++-"), u=[a, b, c]).y, (a + b) - c)
    assert np.array_equal(drive(Sum(signs="++-"), u=[c, b, a]).y, (c + b) - a)


def test_arrays_are_added_element_by_element() -> None:
    assert np.array_equal(drive(Sum(), u=[[[1.0, 2.0]], [[3.0, 5.0]]]).y, [[4.0, 7.0]])


@pytest.mark.parametrize("signs", ["+", "+-+", "+*", "plus"])
def test_signs_that_do_not_fit_the_terms_are_refused(signs: str) -> None:
    with pytest.raises(ParameterError, match=r"signs must be \+ or - for each signal"):
        Sum(signs=signs).with_entries(u=2)


def test_a_sum_of_nothing_is_refused() -> None:
    with pytest.raises(TypeError, match="Sum needs its input 'u'"):
        drive(Sum(), steps=1)
