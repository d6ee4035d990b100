import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.constant import Constant


def test_a_constant_is_the_same_at_every_tick() -> None:
    assert drive(Constant(value=2.5), steps=3).y.tolist() == [2.5, 2.5, 2.5]


@pytest.mark.parametrize("value", [[1.0, 2.0, 3.0], [[1.0, 2.0], [3.0, 4.0]]])
def test_an_array_keeps_its_shape(value: list[object]) -> None:
    assert np.array_equal(drive(Constant(value=value), steps=2).y, [value, value])


def test_a_value_that_is_no_number_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"value must be .*got 'two'"):
        Constant(value="two")
