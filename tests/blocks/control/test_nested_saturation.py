import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.control.nested_saturation import NestedSaturation

AMPLITUDES = (2.0, 0.9, 0.4, 0.19)
measured = st.tuples(st.floats(-50, 50), st.floats(-9, 9), st.floats(-2, 2), st.floats(-5, 5))


def law(block: NestedSaturation, *state: float, **references: float) -> tuple[float, int]:
    names = ("position", "velocity", "angle", "angular_rate")
    result = drive(block, steps=1, **dict(zip(names, state, strict=True)), **references)
    return float(result.torque[0]), int(result.level[0])


def sigma(value: float, amplitude: float) -> float:
    return max(-amplitude, min(amplitude, value))


@given(measured)
def test_bandwidth_one_is_equation_22_bit_for_bit(state: tuple[float, float, float, float]) -> None:
    a1, a2, a3, a4 = AMPLITUDES
    y, yd, phi, phid = state[0] / 9.81, state[1] / 9.81, state[2], state[3]
    inner = sigma(phid + 3 * phi + 3 * yd + y, a4)
    torque = -sigma(phid + sigma(phi + phid + sigma(2 * phi + phid + yd + inner, a3), a2), a1)
    assert law(NestedSaturation(bandwidth=1.0), *state)[0] == torque


@given(measured)
def test_pitch_is_equation_23_roll_with_the_position_turned_round(
    state: tuple[float, float, float, float],
) -> None:
    x, xd, theta, thetad = state
    roll = law(NestedSaturation(), -x, -xd, theta, thetad)
    assert law(NestedSaturation(axis="pitch"), x, xd, theta, thetad) == roll


@given(measured, st.floats(0.3, 5.0))
def test_bandwidth_scales_time(state: tuple[float, float, float, float], bandwidth: float) -> None:
    y, yd, phi, phid = state
    slow = law(NestedSaturation(bandwidth=1.0), bandwidth**2 * y, bandwidth * yd, phi, phid / bandwidth)
    assert law(NestedSaturation(bandwidth=bandwidth), *state)[0] == pytest.approx(
        bandwidth**2 * slow[0], abs=1e-9
    )


@given(measured, st.floats(0.3, 5.0))
def test_the_torque_never_exceeds_its_amplitude(
    state: tuple[float, float, float, float], bandwidth: float
) -> None:
    assert abs(law(NestedSaturation(bandwidth=bandwidth), *state)[0]) <= bandwidth**2 * 2.0


def test_near_the_reference_it_is_the_state_feedback_of_four_equal_poles() -> None:
    block = NestedSaturation(bandwidth=2.0, gravity=1.0)
    gains = [law(block, *(1e-3 * row))[0] / 1e-3 for row in np.eye(4)]
    assert gains == pytest.approx([-16.0, -32.0, -24.0, -8.0])


def test_the_level_tells_the_innermost_saturated_stage() -> None:
    block = NestedSaturation(bandwidth=1.0, gravity=1.0)
    assert law(block, 0.0, 0.0, 0.0, 0.0)[1] == 0
    assert law(block, 10.0, 0.0, 0.0, 0.0)[1] == 4
    # By hand, x1..x4 with the stages inside at rest: only the stage named is beyond its amplitude.
    assert law(block, 0.0, 3.0, -3.0, 0.0)[1] == 3
    assert law(block, 0.0, 0.0, -1.0 / 3.0, 1.0)[1] == 2
    assert law(block, -1.4, 1.3, -1.5, 2.0)[1] == 1
    assert law(block, 0.0, 0.0, -0.1, 0.3)[1] == 0


def test_references_move_the_origin() -> None:
    block = NestedSaturation()
    moved = law(
        block, 3.0, 0.5, 0.1, 0.2, position_reference=2.0, velocity_reference=0.4, angle_reference=0.05
    )
    assert moved[0] == pytest.approx(law(block, 1.0, 0.1, 0.05, 0.2)[0])
    assert law(block, 0.0, 0.0, 0.0, 0.0, feedforward=0.3)[0] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"bandwidth": 0.0}, "bandwidth must be above 0 rad/s, got 0 rad/s"),
        ({"amplitudes": (1.0, 1.0, 0.0, 1.0)}, "amplitudes must be above 0 rad, got 0 rad"),
        ({"amplitudes": (1.0, 1.0)}, "amplitudes must be 4 values"),
        ({"axis": "yaw"}, "axis must be one of roll, pitch"),
    ],
)
def test_parameters_that_make_no_law_are_refused(wrong: dict[str, object], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        NestedSaturation(**wrong)
