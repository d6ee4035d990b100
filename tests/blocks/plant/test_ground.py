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
