import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_blocks._angles import wrapped


@given(st.floats(-1e4, 1e4))
def test_a_wrapped_angle_is_the_same_direction_in_half_a_turn_either_way(angle: float) -> None:
    result = wrapped(angle)
    assert -math.pi - 1e-11 < result <= math.pi + 1e-11
    assert math.cos(result - angle) == pytest.approx(1.0, abs=1e-12)


@given(st.floats(-3.14, 3.14))
def test_an_angle_in_range_is_left_alone_to_the_bit(angle: float) -> None:
    assert wrapped(angle) == angle


def test_the_edge_belongs_to_the_upper_end() -> None:
    assert wrapped(math.pi) == math.pi
    assert wrapped(-math.pi) == math.pi
