import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from quadvis.testing import drive
from quadvis_blocks.supervision.stick_control import StickControl

WEIGHT = 0.5 * 9.81


def control(sticks: list[float], block: StickControl | None = None, **more: Any) -> np.ndarray:
    inputs = {"roll": 0.0, "pitch": 0.0, "rates": [0.0, 0.0, 0.0], **more}
    return drive(block or StickControl(), sticks=sticks, steps=1, **inputs).controls[0]


def test_sticks_in_the_middle_carry_a_level_craft() -> None:
    assert control([0.0] * 4) == pytest.approx([WEIGHT, 0.0, 0.0, 0.0])


def test_the_collective_carries_a_tilted_craft_too() -> None:
    collective = control([0.5, 0.0, 0.0, 0.0], roll=0.3, pitch=-0.2)[0]
    assert collective * math.cos(0.3) * math.cos(0.2) == pytest.approx(WEIGHT + 1.0)


@pytest.mark.parametrize(("axis", "name"), [(1, "roll"), (2, "pitch")])
def test_a_stick_held_tilts_the_craft_without_overshoot(axis: int, name: str) -> None:
    stick = np.zeros(4)
    stick[axis] = 0.5

    def motion(_: float, state: np.ndarray) -> list[float]:
        rates = np.zeros(3)
        rates[axis - 1] = state[1]
        return [state[1], control(list(stick), **{name: state[0], "rates": rates})[axis]]

    path = solve_ivp(motion, (0.0, 3.0), [0.0, 0.0], t_eval=np.linspace(0, 3, 31), rtol=1e-6)
    expected = 0.13 * (1.0 - np.exp(-4.0 * path.t) * (1.0 + 4.0 * path.t))
    assert path.y[0] == pytest.approx(expected, abs=1e-4)


def test_the_yaw_stick_asks_for_a_rate() -> None:
    assert control([0.0, 0.0, 0.0, 0.5], rates=[0.0, 0.0, 0.5])[3] == 0.0
    assert control([0.0, 0.0, 0.0, 0.5])[3] == pytest.approx(2.0)


def test_a_craft_that_steadies_itself_gets_the_sticks_as_they_are() -> None:
    found = control([0.0, 0.1, -0.2, 1.0], StickControl(mode="direct"), roll=0.3, rates=[1.0, 2.0, 3.0])
    assert found[1:] == pytest.approx([0.5, -1.0, 5.0])
