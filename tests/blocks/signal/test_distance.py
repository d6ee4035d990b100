import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis_blocks.signal.distance import Distance

NUMBERS = st.floats(-1e3, 1e3)


def test_it_is_the_hypotenuse() -> None:
    result = drive(Distance(), a=[[3.0, 4.0], [1.0, 1.0]], b=[[0.0, 0.0], [1.0, 1.0]])
    assert result.y.tolist() == [5.0, 0.0]


@given(st.lists(NUMBERS, min_size=6, max_size=6))
def test_it_is_that_of_python_in_space_too(numbers: list[float]) -> None:
    a, b = numbers[:3], numbers[3:]
    result = drive(Distance(), a=np.array([a]), b=np.array([b]))
    assert result.y[0] == pytest.approx(math.dist(a, b), rel=1e-12, abs=1e-200)
