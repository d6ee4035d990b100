import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.control.heading_rotation import HeadingRotation


def test_at_heading_zero_forward_is_x_and_right_is_y() -> None:
    result = drive(
        HeadingRotation(), position=[1.0, 2.0, 9.0], velocity=[3.0, 4.0, 9.0], heading=0.0, steps=1
    )
    found = (result.forward[0], result.right[0], result.forward_velocity[0], result.right_velocity[0])
    assert found == (1.0, 2.0, 3.0, 4.0)


def test_an_offset_is_added_to_the_heading() -> None:
    inputs = {"position": [1.0, 2.0, 9.0], "velocity": [3.0, 4.0, 9.0], "steps": 1}
    given, turned = (
        drive(HeadingRotation(offset=offset), heading=heading, **inputs)
        for offset, heading in ((0.0, 0.7), (0.4, 0.3))
    )
    for name in ("forward", "right", "forward_velocity", "right_velocity"):
        assert turned.signals[name] == pytest.approx(given.signals[name])


def test_turned_clockwise_by_a_quarter_the_craft_looks_to_the_right() -> None:
    # Looking along y, it has x on its left hand.
    result = drive(
        HeadingRotation(), position=[1.0, 0.0, 0.0], velocity=[0.0, 1.0, 0.0], heading=math.pi / 2, steps=1
    )
    assert (result.forward[0], result.right[0]) == pytest.approx((0.0, -1.0))
    assert (result.forward_velocity[0], result.right_velocity[0]) == pytest.approx((1.0, 0.0))


@given(
    st.floats(-4, 4),
    st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
)
def test_errors_turn_back_into_the_world_by_the_heading(
    heading: float, position: tuple[float, float], reference: tuple[float, float]
) -> None:
    result = drive(
        HeadingRotation(),
        position=[*position, 1.0], velocity=[*reference, 0.0], heading=heading,
        position_reference=[*reference, 2.0], velocity_reference=[*position, 0.0],
        steps=1,
    )  # fmt: skip
    turn = complex(math.cos(heading), math.sin(heading))
    error = complex(*position) - complex(*reference)
    assert complex(result.forward[0], result.right[0]) * turn == pytest.approx(error, abs=1e-9)
    assert complex(result.forward_velocity[0], result.right_velocity[0]) * turn == pytest.approx(
        -error, abs=1e-9
    )


def test_switched_off_it_gives_the_errors_unturned() -> None:
    result = drive(
        HeadingRotation(enabled=False), position=np.ones(3), velocity=np.zeros(3), heading=1.0, steps=1
    )
    assert (result.forward[0], result.right[0]) == (1.0, 1.0)


def test_a_switch_that_is_neither_on_nor_off_is_refused() -> None:
    with pytest.raises(ParameterError, match="enabled must be"):
        HeadingRotation(enabled="perhaps")
