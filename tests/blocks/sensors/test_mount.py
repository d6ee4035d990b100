from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis.testing import Driven, drive
from quadvis_blocks.sensors.mount import Mount

angles = st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
offsets = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
POSITION = np.array([1.0, -2.0, 1.5])


def mounted(attitude: Any, **parameters: Any) -> Driven:
    return drive(Mount(**parameters), position=POSITION, attitude=np.array(attitude), steps=1)


def turn(attitude: Any) -> Rotation:
    return Rotation.from_euler("ZYX", attitude[::-1])


def test_a_device_in_the_middle_is_where_the_craft_is_to_the_bit() -> None:
    result = mounted((0.1, -0.2, 3.0))
    assert result.place[0].tolist() == POSITION.tolist()
    assert result.turned[0].tolist() == [0.1, -0.2, 3.0]


@given(angles, offsets)
def test_its_place_turns_with_the_craft_and_up_is_up(attitude: Any, offset: Any) -> None:
    forward, right, down = turn(attitude).apply(np.array(offset) * (1, 1, -1))
    assert mounted(attitude, offset=offset).place[0] == pytest.approx(
        POSITION + np.array([forward, right, -down])
    )


@given(angles, angles)
def test_it_is_turned_against_the_axes_of_the_craft(attitude: Any, mount: Any) -> None:
    found = turn(mounted(attitude, angles=mount).turned[0])
    assert (found.inv() * turn(attitude) * turn(mount)).magnitude() == pytest.approx(0.0, abs=1e-7)


def test_a_camera_ahead_of_a_craft_that_heads_right_is_to_the_right() -> None:
    assert mounted((0.0, 0.0, np.pi / 2), offset=(0.1, 0.0, 0.05)).place[0] - POSITION == pytest.approx(
        (0.0, 0.1, 0.05)
    )
