from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.landing import Landing

HERE = [0.2, -0.1, 1.5]


def land(seconds: float, block: Landing | None = None, **more: Any) -> Driven:
    inputs = {"position_reference": HERE, "descend": True, "height": 1.5, "climb": 0.0}
    return drive(block or Landing(), rate="20 Hz", steps=round(20 * seconds), **{**inputs, **more})


def test_without_a_descent_the_reference_passes() -> None:
    found = land(1.0, descend=False, velocity_reference=[0.1, 0.2, 0.3])
    assert (found.position == HERE).all() and (found.velocity == [0.1, 0.2, 0.3]).all()
    assert not found.landed.any()


def test_the_reference_goes_down_from_where_it_stood_at_three_tenths_of_a_metre_a_second() -> None:
    moving = np.linspace(HERE, [5.0, 5.0, 5.0], 80)
    found = land(4.0, position_reference=moving, height=np.linspace(1.5, 0.3, 80), climb=-0.3)
    assert found.position[:, 2] == pytest.approx(1.5 - 0.3 * found.time)
    assert (found.position[:, :2] == HERE[:2]).all()
    assert (found.velocity == [0.0, 0.0, -0.3]).all()
    assert not found.landed.any()


def test_a_craft_that_neither_follows_nor_moves_for_half_a_second_has_landed() -> None:
    height = np.maximum(1.5 - 0.3 * np.arange(140) / 20, 0.17)  # the ground is where nobody said it is
    climb = np.where(height > 0.17, -0.3, 0.0)
    found = land(7.0, height=height, climb=climb)
    touched = found.time[np.argmax(climb == 0.0)]
    # 0.15 m of reference below the craft take half a second, then it must rest for half a second.
    assert found.time[np.argmax(found.landed)] == pytest.approx(touched + 1.0, abs=0.1)
    assert found.landed[-1]


def test_a_craft_held_up_by_a_gust_has_not_landed() -> None:
    climb = np.where(np.arange(80) % 8 == 0, 0.2, 0.0)  # it moves every 0.4 s
    assert not land(4.0, climb=climb).landed.any()


def test_blind_it_has_landed_when_the_reference_is_well_below_the_ground() -> None:
    found = land(8.0, height=0.0, climb=0.0, blind=True)
    assert found.time[np.argmax(found.landed)] == pytest.approx(2.0 / 0.3, abs=0.05)
    assert found.position[:, 2].min() == pytest.approx(-0.5)
    assert (found.velocity[found.position[:, 2] <= -0.5] == 0.0).all()


def test_landed_stays_until_the_descent_ends() -> None:
    descend = np.arange(200) < 190
    climb = np.where(np.arange(200) < 100, 0.0, 1.0)
    found = land(10.0, descend=descend, height=1.5, climb=climb)
    first = int(np.argmax(found.landed))
    assert found.landed[first:190].all() and not found.landed[190:].any()


def test_recapture_takes_x_and_y_anew_and_leaves_the_height() -> None:
    moved = np.array([HERE] * 20 + [[1.0, 2.0, 9.0]] * 20)
    found = land(2.0, position_reference=moved, recapture=np.arange(40) == 25)
    assert (found.position[:25, :2] == HERE[:2]).all() and (found.position[25:, :2] == [1.0, 2.0]).all()
    assert found.position[:, 2] == pytest.approx(1.5 - 0.3 * found.time)


@given(st.floats(0.05, 1.0), st.floats(0.1, 3.0), st.floats(-1.0, 1.0))
def test_the_reference_never_goes_up_nor_faster_than_its_speed(
    speed: float, begin: float, ground: float
) -> None:
    found = land(5.0, Landing(speed=speed, ground=ground), position_reference=[0.0, 0.0, begin])
    steps = np.diff(found.position[:, 2])
    assert (steps <= 0.0).all() and (steps >= -speed / 20 - 1e-12).all()
    assert found.position[:, 2].min() >= min(begin, ground - 0.5) - speed / 20
