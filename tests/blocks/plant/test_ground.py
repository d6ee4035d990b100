import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from quadvis.testing import drive
from quadvis_blocks.plant.ground import Ground

numbers = st.floats(-2, 2)


def force(position: list[float], velocity: list[float]) -> np.ndarray:
    return drive(Ground(), position=position, velocity=velocity, steps=1).force[0]


@given(st.floats(0, 9), st.lists(numbers, min_size=3, max_size=3))
def test_above_the_ground_there_is_no_force(height: float, velocity: list[float]) -> None:
    assert (force([0.0, 0.0, height], velocity) == 0.0).all()


@given(st.floats(-0.1, -1e-6), st.lists(numbers, min_size=3, max_size=3))
def test_it_only_pushes_and_never_drives_the_craft(height: float, velocity: list[float]) -> None:
    found = force([0.0, 0.0, height], velocity)
    assert found[2] >= 0.0
    assert found[:2] @ velocity[:2] <= 0.0
    assert np.hypot(*found[:2]) <= 0.6 * found[2] + 1e-12


def test_a_craft_at_rest_stands_a_centimetre_deep() -> None:
    assert force([3.0, 4.0, -0.5 * 9.81 / 500.0], [0.0, 0.0, 0.0]) == pytest.approx([0.0, 0.0, 0.5 * 9.81])


def test_a_craft_that_comes_down_gently_hardly_bounces() -> None:
    def motion(_: float, state: np.ndarray) -> list[float]:
        return [state[1], force([0.0, 0.0, state[0]], [0.0, 0.0, state[1]])[2] / 0.5 - 9.81]

    path = solve_ivp(motion, (0.0, 1.5), [0.0, -0.3], max_step=0.02)
    assert path.y[0].min() > -0.025 and path.y[0].max() < 0.005
    assert path.y[0, -1] == pytest.approx(-0.00981, abs=1e-3)


def test_the_hardest_touch_down_is_told() -> None:
    height = [0.1, -0.01, -0.01, 0.1, -0.01, 0.1, -0.01]
    velocity = [[0.0, 0.0, -speed] for speed in (0.9, 0.3, 0.8, 0.0, 0.5, 0.0, 0.2)]
    found = drive(Ground(), position=[[0.0, 0.0, h] for h in height], velocity=velocity)
    assert found.impact.tolist() == [0.0, 0.3, 0.3, 0.3, 0.5, 0.5, 0.5]


def rotation(roll: float, pitch: float) -> np.ndarray:
    """Body to north-east-down: Ry(pitch) Rx(roll)."""
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    return np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


@given(
    st.floats(-0.02, 0.1), st.floats(-0.5, 0.5), st.tuples(*[st.floats(-0.6, 0.6)] * 2),
    st.tuples(*[st.floats(-3.0, 3.0)] * 2),
)  # fmt: skip
def test_each_foot_is_a_spring_and_a_damper_of_its_own(
    height: float, climb: float, tilt: tuple[float, float], turning: tuple[float, float]
) -> None:
    found = drive(
        Ground(friction=0.0), position=[0.0, 0.0, height], velocity=[0.0, 0.0, climb],
        attitude=[*tilt, 0.3], rates=[*turning, 0.0], steps=1,
    )  # fmt: skip
    body, force, torque = rotation(*tilt), 0.0, np.zeros(3)
    for foot in 0.15 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]):
        below = -(height - (body @ foot)[2])
        rising = climb - (body @ np.cross([*turning, 0.0], foot))[2]
        push = max(0.0, 125.0 * below - 5.0 * rising) if height < 0.15 else 0.0
        force += push
        torque += np.cross(foot, body.T @ [0.0, 0.0, -push])
    touches = height < 0.15 * np.abs(body[2, :2]).max()
    assert bool(found.contact[0]) == touches
    if touches:
        assert found.force[0, 2] == pytest.approx(force, abs=1e-9)
        assert found.torque[0, :2] == pytest.approx(torque[:2], abs=1e-9)


def test_a_craft_that_stands_askew_settles_level() -> None:
    def motion(_: float, state: np.ndarray) -> list[float]:
        h, roll, climb, rate = state
        found = drive(
            Ground(), position=[0.0, 0.0, h], velocity=[0.0, 0.0, climb], attitude=[roll, 0.0, 0.0],
            rates=[rate, 0.0, 0.0], steps=1,
        )  # fmt: skip
        return [climb, rate, found.force[0, 2] / 0.5 - 9.81, found.torque[0, 0] / 5e-3]

    path = solve_ivp(motion, (0.0, 1.0), [0.02, 0.2, 0.0, 0.0], max_step=0.02, rtol=1e-4)
    assert path.y[:, -1] == pytest.approx([-0.00981, 0.0, 0.0, 0.0], abs=1e-3)
    assert path.y[1].min() > -0.05


def test_standing_on_it_the_craft_cannot_turn_freely() -> None:
    found = drive(Ground(), position=[0.0, 0.0, -0.01], velocity=[0.0] * 3, rates=[0.0, 0.0, 2.0], steps=1)
    assert found.torque[0] == pytest.approx([0.0, 0.0, -0.6 * 5.0 * 0.15])
