from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.landing import Landing

HERE = [0.2, -0.1, 1.5]
AWAY = [0.3, 0.1, 1.5]


def land(seconds: float, block: Landing | None = None, **more: Any) -> Driven:
    """Land from HERE at 20 Hz; unless its height is given the craft follows the reference."""
    steps = round(20 * seconds)
    current = np.tile(AWAY, (steps, 1))
    current[:, 2] = more.pop("height", 1.5 - 0.015 * np.arange(steps))
    inputs = {"position_reference": HERE, "descend": True, "current": current}
    return drive(block or Landing(), rate="20 Hz", steps=steps, **{**inputs, **more})


def descent(time: Any, begin: float = 1.5) -> Any:
    """The height of a reference that goes down at 0.3 m/s to 0.5 m, and then at 0.2 m/s."""
    flare = max(0.0, (begin - 0.5) / 0.3)
    return np.where(time < flare, begin - 0.3 * time, min(begin, 0.5) - 0.2 * (time - flare))


def test_without_a_descent_the_reference_passes() -> None:
    found = land(1.0, descend=False, velocity_reference=[0.1, 0.2, 0.3])
    assert (found.position == HERE).all() and (found.velocity == [0.1, 0.2, 0.3]).all()
    assert not found.landed.any()


def test_the_reference_goes_down_from_where_it_stood_at_three_tenths_of_a_metre_a_second() -> None:
    moving = np.linspace(HERE, [5.0, 5.0, 5.0], 60)
    found = land(3.0, position_reference=moving)
    assert found.position[:, 2] == pytest.approx(1.5 - 0.3 * found.time)
    assert (found.position[:, :2] == HERE[:2]).all()
    assert (found.velocity == [0.0, 0.0, -0.3]).all()
    assert not found.landed.any()


def test_near_the_ground_it_slows_down() -> None:
    found = land(6.0)
    assert found.position[:, 2] == pytest.approx(descent(found.time), abs=0.011)
    assert (found.velocity[found.position[:, 2] < 0.5, 2] == -0.2).all()


def test_once_the_reference_is_below_the_ground_nothing_pushes_the_craft_sideways() -> None:
    found = land(8.0, current_velocity=[0.7, -0.4, 0.1])
    below = found.position[:, 2] < 0.0
    assert below.any() and (found.position[~below, :2] == HERE[:2]).all()
    assert (found.velocity[~below, :2] == 0.0).all()
    assert (found.position[below, :2] == AWAY[:2]).all()
    assert (found.velocity[below, :2] == [0.7, -0.4]).all() and (found.velocity[below, 2] < 0.0).any()


def test_a_craft_that_does_not_follow_for_a_second_has_landed() -> None:
    height = np.maximum(1.5 - 0.3 * np.arange(160) / 20, 0.17)  # the ground is where nobody said it is
    noise = np.random.default_rng(1).normal(0.0, 0.01, len(height))
    found = land(8.0, height=height + noise)
    touched = found.time[np.argmax(height == 0.17)]
    assert found.time[np.argmax(found.landed)] == pytest.approx(touched + 1.0, abs=0.3)
    assert found.landed[-1]


def test_a_craft_that_a_gust_holds_up_for_a_while_has_not_landed() -> None:
    height = 1.5 + 0.1 * np.sin(np.arange(80) / 5.0)  # for four seconds it does not get down
    assert not land(4.0, height=height).landed.any()


def test_blind_it_has_landed_when_the_reference_is_well_below_the_ground() -> None:
    found = land(15.0, height=0.0, blind=True)
    assert found.time[np.argmax(found.landed)] == pytest.approx(1.0 / 0.3 + 2.0 / 0.2, abs=0.1)
    assert found.position[:, 2].min() == pytest.approx(-1.5)
    assert (found.velocity[found.position[:, 2] <= -1.5] == 0.0).all()


def test_landed_stays_until_the_descent_ends() -> None:
    descend = np.arange(200) < 190
    height = np.where(np.arange(200) < 100, 0.0, 1.0)
    found = land(10.0, descend=descend, height=height, position_reference=[0.0, 0.0, 0.2])
    first = int(np.argmax(found.landed))
    assert 0 < first < 100
    assert found.landed[first:190].all() and not found.landed[190:].any()


def test_recapture_takes_x_and_y_anew_and_leaves_the_height() -> None:
    moved = np.array([HERE] * 20 + [[1.0, 2.0, 9.0]] * 20)
    found = land(2.0, position_reference=moved, recapture=np.arange(40) == 25)
    assert (found.position[:25, :2] == HERE[:2]).all() and (found.position[25:, :2] == [1.0, 2.0]).all()
    assert found.position[:, 2] == pytest.approx(1.5 - 0.3 * found.time)


@pytest.mark.parametrize("height", [0.4, 2.0])
def test_seen_again_elsewhere_than_reckoned_the_craft_goes_on_down_from_there(height: float) -> None:
    found = land(3.0, height=np.where(np.arange(60) < 30, 1.5, height), blind=np.arange(60) < 30)
    assert found.position[29, 2] == pytest.approx(1.5 - 0.3 * 29 / 20)
    assert found.position[30:, 2] == pytest.approx(descent(np.arange(30) / 20, height))


def test_a_craft_on_the_ground_is_not_pushed_sideways() -> None:
    found = land(4.0, height=1.0)
    high = 1.0 - found.position[:, 2] > 0.15 + 1e-9
    assert (found.position[high, :2] == AWAY[:2]).all() and high.any()
    assert (found.position[~high, :2] == HERE[:2]).all()


@given(st.floats(0.05, 1.0), st.floats(0.1, 3.0), st.floats(-1.0, 1.0))
def test_the_reference_never_goes_up_nor_faster_than_its_speed(
    speed: float, begin: float, ground: float
) -> None:
    found = land(5.0, Landing(speed=speed, ground=ground), position_reference=[0.0, 0.0, begin])
    steps = np.diff(found.position[:, 2])
    assert (steps <= 0.0).all() and (steps >= -speed / 20 - 1e-12).all()
    assert found.position[:, 2].min() >= min(begin, ground - 1.5)
