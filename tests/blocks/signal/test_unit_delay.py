import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.unit_delay import UnitDelay


def test_the_output_is_the_input_of_one_sample_ago() -> None:
    assert drive(UnitDelay(initial=7.0), u=[1.0, 2.0, 3.0]).y.tolist() == [7.0, 1.0, 2.0]


def test_an_array_is_delayed_whole() -> None:
    assert np.array_equal(drive(UnitDelay(), u=[[1.0, 2.0], [3.0, 4.0]]).y, [[0.0, 0.0], [1.0, 2.0]])


def test_it_breaks_loops() -> None:
    assert UnitDelay.interface.feedthrough == frozenset()


def test_an_initial_value_that_is_no_number_is_refused() -> None:
    with pytest.raises(ParameterError, match="initial must be a number"):
        UnitDelay(initial="none")


def test_each_element_may_have_an_initial_value_of_its_own() -> None:
    found = drive(UnitDelay(initial=[1.0, 2.0]), u=[[3.0, 4.0], [5.0, 6.0]]).y
    assert np.array_equal(found, [[1.0, 2.0], [3.0, 4.0]])
