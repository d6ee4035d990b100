import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis_vision.calibrate.mount import Uncertain, find_angles, find_offset, swept

TIMES = 0.1 * np.arange(60)
MOUNTS = st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-3.0, 3.0))
KNOWN = np.zeros((3, 3))


def turn(attitude: Any) -> Rotation:
    return Rotation.from_euler("ZYX", np.atleast_2d(attitude)[:, ::-1])


def rocking(yaw: Any = 0.0) -> Any:
    """Attitudes (N, 3) of a craft that rocks by 2 deg about a trim of 1 deg."""
    roll = math.radians(2) * np.sin(3 * TIMES) + math.radians(1)
    return np.column_stack((roll, math.radians(2) * np.cos(2 * TIMES), np.full(len(TIMES), yaw)))


def seen(craft: Any, mount: Any) -> Any:
    """Attitudes (N, 3) of the camera."""
    return (turn(craft) * turn(mount)).as_euler("ZYX")[:, ::-1]


@settings(max_examples=8, deadline=None)
@given(MOUNTS, st.floats(-3.0, 3.0))
def test_tilts_without_errors_give_the_angles_at_any_heading(mount: Any, yaw: float) -> None:
    craft = rocking(yaw)
    found = find_angles(TIMES, seen(craft, mount)[:, :2], craft[:, :2])
    assert found.values == pytest.approx(mount, abs=1e-6)


def test_with_a_known_yaw_only_roll_and_pitch_are_found() -> None:
    craft = rocking()
    found = find_angles(TIMES, seen(craft, (0.05, -0.03, 0.4))[:, :2], craft[:, :2], yaw=0.4)
    assert found.values == pytest.approx((0.05, -0.03), abs=1e-8) and found.covariance.shape == (2, 2)


def test_a_craft_that_does_not_move_shows_roll_and_pitch_and_no_yaw() -> None:
    rng = np.random.default_rng(1)
    level = np.zeros((60, 3))
    camera = seen(level, (0.05, -0.03, 0.4))[:, :2] + 0.002 * rng.normal(size=(60, 2))
    found = find_angles(TIMES, camera, level[:, :2])
    assert found.deviations[2] > math.radians(5)
    held = find_angles(TIMES, camera, level[:, :2], yaw=0.4)
    assert np.all(np.abs(held.values - (0.05, -0.03)) < 4 * held.deviations)
    assert held.deviations.max() < 0.002


@settings(max_examples=8, deadline=None)
@given(MOUNTS, st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)), st.floats(-0.2, 0.2))
def test_a_turn_gives_the_offset(mount: Any, offset: Any, up: float) -> None:
    craft = rocking(np.linspace(0.0, 2.0, len(TIMES)))
    place = np.array((1.0, -0.5, 2.0)) + turn(craft).apply((*offset, -up))
    angles = Uncertain(np.array(mount), KNOWN)
    found = find_offset(TIMES, place[:, :2], seen(craft, mount), angles, up)
    assert found.values == pytest.approx(offset, abs=1e-8)


def test_an_uncertain_yaw_of_the_mount_turns_the_offset() -> None:
    craft = rocking(np.linspace(0.0, 2.0, len(TIMES)))
    place = turn(craft).apply((0.2, 0.0, 0.0))
    vague = Uncertain(np.zeros(3), np.diag((0.0, 0.0, 0.1**2)))
    found = find_offset(TIMES, place[:, :2], craft, vague, 0.0)
    assert found.deviations == pytest.approx((0.0, 0.02), abs=1e-6)


def test_headings_may_pass_half_a_turn() -> None:
    assert swept(np.array([3.0, -3.1, -2.9, 3.1])) == pytest.approx(2 * math.pi - 5.9)
