import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.control.mixer import Mixer

ARM, RATIO, INERTIA = 0.24, 0.016, (5e-3, 5e-3, 9e-3)
# What thrusts of front, right, rear and left do: collective; roll, pitch, yaw torque over inertia.
EFFECT = np.array([
    [1, 1, 1, 1],
    [0, -ARM / INERTIA[0], 0, ARM / INERTIA[0]],
    [ARM / INERTIA[1], 0, -ARM / INERTIA[1], 0],
    [RATIO / INERTIA[2], -RATIO / INERTIA[2], RATIO / INERTIA[2], -RATIO / INERTIA[2]],
])  # fmt: skip


def mix(
    collective: float, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
) -> tuple[np.ndarray, bool]:
    result = drive(Mixer(), collective=collective, roll=roll, pitch=pitch, yaw=yaw, steps=1)
    return result.thrust[0], bool(result.saturated[0])


@given(st.lists(st.floats(0.01, 1.99), min_size=4, max_size=4))
def test_whatever_thrusts_the_rotors_can_give_are_found_again_from_their_effect(thrusts: list[float]) -> None:
    found, saturated = mix(*(EFFECT @ thrusts))
    assert found == pytest.approx(np.array(thrusts), abs=1e-12)
    assert not saturated


@given(st.floats(-5, 20), st.floats(-300, 300), st.floats(-300, 300), st.floats(-60, 60))
def test_what_is_given_is_the_effect_of_the_thrusts_and_what_is_limited_is_where_it_differs(
    collective: float, roll: float, pitch: float, yaw: float
) -> None:
    wanted = np.array([collective, roll, pitch, yaw])
    result = drive(Mixer(), collective=collective, roll=roll, pitch=pitch, yaw=yaw, steps=1)
    assert result.given[0] == pytest.approx(EFFECT @ result.thrust[0], abs=1e-9)
    differs = np.abs(result.given[0] - wanted)
    assert (result.limited[0] | (differs < 1e-8)).all()
    assert (~result.limited[0] | (differs > 0.0)).all()
    assert result.saturated[0] == result.limited[0].any()


def test_right_side_down_needs_the_left_rotor_and_nose_up_the_front_one() -> None:
    thrusts, _ = mix(4.0, roll=10.0)
    assert thrusts[3] > thrusts[1]
    thrusts, _ = mix(4.0, pitch=10.0)
    assert thrusts[0] > thrusts[2]


def test_clockwise_needs_the_rotors_that_turn_counterclockwise() -> None:
    thrusts, _ = mix(4.0, yaw=1.0)
    assert thrusts[0] == thrusts[2] > thrusts[1] == thrusts[3]


@given(st.floats(-5, 20), st.floats(-300, 300), st.floats(-300, 300), st.floats(-60, 60))
def test_beyond_the_limits_yaw_gives_way_first_then_the_collective_then_roll_and_pitch(
    collective: float, roll: float, pitch: float, yaw: float
) -> None:
    thrusts, saturated = mix(collective, roll, pitch, yaw)
    assert (thrusts >= 0.0).all() and (thrusts <= 2.0).all()
    got = EFFECT @ thrusts
    excess = (
        max(abs(roll), abs(pitch)) * 0.5 * INERTIA[0] / ARM
    )  # N that one rotor of a pair needs, 1 is there
    assert got[1:3] == pytest.approx(np.array([roll, pitch]) / max(1.0, excess), abs=1e-6)
    error = collective - got[0]
    if abs(error) > 1e-6:  # no yaw torque, whatever it be, makes room for more
        limit = 2.0 if error > 0 else 0.0
        assert np.abs(thrusts[[0, 2]] - limit).min() < 1e-9 and np.abs(thrusts[[1, 3]] - limit).min() < 1e-9
    error = yaw - got[3]
    if abs(error) > 1e-6:
        with_it, against_it = ([0, 2], [1, 3]) if error > 0 else ([1, 3], [0, 2])
        assert thrusts[with_it].max() > 2.0 - 1e-9 or thrusts[against_it].min() < 1e-9
    assert saturated or got == pytest.approx(np.array([collective, roll, pitch, yaw]), abs=1e-6)


def test_yaw_gives_way_while_the_collective_is_kept() -> None:
    thrusts, saturated = mix(7.0, roll=5.0, yaw=50.0)
    assert saturated
    assert EFFECT[:3] @ thrusts == pytest.approx([7.0, 5.0, 0.0], abs=1e-12)


def test_the_collective_gives_way_while_roll_and_pitch_are_kept() -> None:
    for collective in (20.0, -3.0):
        thrusts, saturated = mix(collective, roll=20.0, pitch=-10.0)
        assert saturated
        assert EFFECT[1:3] @ thrusts == pytest.approx([20.0, -10.0])


@pytest.mark.parametrize(("axis", "authority"), [("roll", 74.2), ("pitch", 74.2), ("yaw", 5.5)])
def test_at_hover_yaw_is_the_axis_with_the_least_authority(axis: str, authority: float) -> None:
    # Each rotor carries 1.226 N of its 2 N: the margin of 0.774 N, up and down, on one axis.
    thrusts, saturated = mix(0.5 * 9.81, **{axis: authority})
    assert not saturated
    assert (EFFECT @ thrusts)[1:].max() == pytest.approx(authority, rel=0.01)
    assert thrusts.max() == pytest.approx(2.0, abs=0.01)


def test_limits_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"thrust_min must be below thrust_max, 2 N, got 2\.5 N"):
        Mixer(thrust_min=2.5)
