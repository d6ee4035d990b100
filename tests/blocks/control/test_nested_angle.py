import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis_blocks.control.nested_angle import NestedAngle
from quadvis_blocks.control.nested_saturation import NestedSaturation

places = st.tuples(st.floats(-50, 50), st.floats(-9, 9))
AXES = ("roll", "pitch")


def angle(block: NestedAngle, position: float, velocity: float, **others: float) -> float:
    return float(drive(block, steps=1, position=position, velocity=velocity, **others).angle[0])


@given(places, st.floats(0.5, 4.0), st.sampled_from(AXES))
def test_at_this_angle_the_law_of_the_paper_asks_for_no_torque(
    place: tuple[float, float], bandwidth: float, axis: str
) -> None:
    block = NestedAngle(bandwidth=bandwidth, axis=axis)
    law = NestedSaturation(bandwidth=bandwidth, axis=axis)
    asked = angle(block, *place)
    state = {"position": place[0], "velocity": place[1], "angle": asked, "angular_rate": 0.0}
    assert drive(law, steps=1, **state).torque[0] == pytest.approx(0.0, abs=1e-9)


@given(places, st.floats(0.5, 4.0))
def test_the_angle_is_limited_and_odd(place: tuple[float, float], bandwidth: float) -> None:
    block = NestedAngle(bandwidth=bandwidth, amplitudes=(0.3, 0.1))
    asked = angle(block, *place)
    assert abs(asked) <= 0.3
    assert angle(block, -place[0], -place[1]) == -asked


def test_near_the_reference_it_is_a_state_feedback_in_the_sense_of_the_axis() -> None:
    # lambda 2, g 10: x1 = 4 * 0.05 / 10, x2 = 2 * 0.1 / 10
    wanted = -(4 * 0.02 + 0.02) / 6
    near = {"position": 1.05, "velocity": 0.3, "position_reference": 1.0, "velocity_reference": 0.2}
    assert angle(NestedAngle(gravity=10.0), **near) == pytest.approx(wanted)
    assert angle(NestedAngle(gravity=10.0, axis="pitch"), **near) == pytest.approx(-wanted)


def test_the_angle_that_balances_the_wind_is_added() -> None:
    assert angle(NestedAngle(), 0.0, 0.0, angle_reference=0.07) == 0.07


@pytest.mark.parametrize("start", [0.1, 3.0])
def test_a_craft_that_takes_the_angle_at_once_comes_to_the_reference(start: float) -> None:
    block, step = NestedAngle(bandwidth=2.0), 0.02
    position, velocity, fastest = start, 0.0, 0.0
    for _ in range(1000):
        velocity += step * block.gravity * angle(block, position, velocity)
        position += step * velocity
        fastest = max(fastest, abs(velocity))
    assert abs(position) < 1e-3
    assert fastest < 1.1 * block.gravity * block.amplitudes[1] / block.bandwidth
    assert np.isfinite(fastest)
