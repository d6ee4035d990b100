import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis_blocks._angles import askew, carrier, is_zero, rotation, turned, wrapped

ATTITUDES = st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)).map(np.array)


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


def scipy_rotation(attitude: Any) -> Rotation:
    return Rotation.from_euler("ZYX", attitude[::-1])


@given(ATTITUDES, st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array))
def test_a_rotation_is_that_of_scipy(attitude: Any, vector: Any) -> None:
    assert rotation(*attitude) == pytest.approx(scipy_rotation(attitude).as_matrix(), abs=1e-14)
    assert turned(rotation(*attitude), vector) == pytest.approx(
        scipy_rotation(attitude).apply(vector), abs=1e-14
    )


@given(ATTITUDES, ATTITUDES)
def test_a_device_is_turned_against_the_axes_of_its_craft(attitude: Any, mount: Any) -> None:
    expected = scipy_rotation(attitude) * scipy_rotation(mount)
    assert (scipy_rotation(askew(attitude, mount)).inv() * expected).magnitude() == pytest.approx(
        0.0, abs=1e-7
    )


@given(ATTITUDES, ATTITUDES)
def test_the_craft_is_found_again_from_its_device(attitude: Any, mount: Any) -> None:
    found = carrier(askew(attitude, mount), mount)
    assert (scipy_rotation(found).inv() * scipy_rotation(attitude)).magnitude() == pytest.approx(
        0.0, abs=1e-7
    )


def test_a_device_that_is_not_turned_has_the_attitude_of_the_craft_to_the_bit() -> None:
    attitude, zero = np.array((0.1, -0.2, 3.0)), np.zeros(3)
    assert is_zero(zero) and not is_zero(np.array((0.0, 0.0, 1e-300)))
    for found in (askew(attitude, zero), carrier(attitude, zero)):
        assert found.tolist() == attitude.tolist() and found is not attitude
