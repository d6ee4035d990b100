import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis.testing import Driven, drive
from quadvis_blocks.estimation.craft_pose import CraftPose
from quadvis_blocks.vision.geometric_camera import GeometricCamera
from quadvis_blocks.vision.pose_plane import PosePlane

CALIBRATION = str(Path(__file__).parents[3] / "diagrams" / "calib" / "camera.yaml")
CEILING = 4.5
ATTITUDES = st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
OFFSETS = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
POSITION = np.array([0.3, -0.2, 2.9])


def craft(position: Any, attitude: Any, **parameters: Any) -> Driven:
    names = ("camera_roll", "camera_pitch", "camera_yaw")
    angles = dict(zip(names, map(float, attitude), strict=True))
    return drive(CraftPose(**parameters), camera_position=np.array(position), **angles, steps=1)


def turn(angles: Any) -> Rotation:
    return Rotation.from_euler("ZYX", np.asarray(angles)[::-1])


def attitude_of(found: Driven) -> Any:
    return np.array((found.roll[0], found.pitch[0], found.yaw[0]))


def mounted(position: Any, attitude: Any, offset: Any, angles: Any) -> tuple[Any, Any]:
    """Position (target frame) and attitude of a camera on a craft, by scipy's rotations."""
    place = position + turn(attitude).apply(np.array(offset) * (1, 1, -1))
    return place, (turn(attitude) * turn(angles)).as_euler("ZYX")[::-1]


def test_without_a_mount_the_camera_is_the_craft_to_the_bit() -> None:
    found = craft(POSITION, (0.1, -0.2, math.pi))
    assert found.position[0].tolist() == POSITION.tolist()
    assert attitude_of(found).tolist() == [0.1, -0.2, math.pi]


def test_a_camera_ahead_of_the_middle_of_a_craft_that_heads_right_is_right_of_it() -> None:
    found = craft(POSITION, (0.0, 0.0, math.pi / 2), offset=(0.1, 0.0, 0.05))
    assert found.position[0] - POSITION == pytest.approx((0.0, -0.1, 0.05))


def test_a_craft_whose_camera_is_turned_by_its_own_tilt_is_level() -> None:
    found = craft(POSITION, (0.05, -0.08, 0.7), angles=(0.05, -0.08, 0.0))
    assert attitude_of(found) == pytest.approx((0.0, 0.0, 0.7), abs=1e-15)
    assert found.position[0].tolist() == POSITION.tolist()


@given(ATTITUDES, OFFSETS, ATTITUDES)
def test_it_inverts_the_mount(attitude: Any, offset: Any, angles: Any) -> None:
    found = craft(*mounted(POSITION, attitude, offset, angles), offset=offset, angles=angles)
    assert found.position[0] == pytest.approx(POSITION, abs=1e-9)
    assert (turn(attitude_of(found)).inv() * turn(attitude)).magnitude() == pytest.approx(0.0, abs=1e-7)


def test_a_target_that_is_not_seen_stays_missing() -> None:
    missing = [math.nan] * 3
    for mount in ({}, {"offset": (0.1, 0.2, 0.3), "angles": (0.1, 0.2, 0.3)}):
        found = craft(missing, missing, **mount)
        assert np.isnan(found.position).all() and np.isnan(attitude_of(found)).all()


def test_without_roll_and_pitch_the_camera_counts_as_level() -> None:
    found = drive(CraftPose(offset=(0.1, 0, 0)), camera_position=POSITION, camera_yaw=0.0, steps=1)
    assert found.position[0] == pytest.approx(POSITION - (0.1, 0.0, 0.0))


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.06, -0.05, 0.4)])
@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (0.12, -0.05, 0.08)])
def test_the_place_of_the_craft_is_found_through_a_camera_that_sits_askew(offset: Any, angles: Any) -> None:
    attitude = np.array((0.03, -0.02, 0.5))
    place, tilted = mounted(POSITION, attitude, offset, angles)
    seen = drive(
        GeometricCamera(calibration=CALIBRATION, noise=0.0, ceiling=CEILING, radius=1e-9),
        position=place * (1, 1, -1) + (0, 0, CEILING),
        attitude=tilted,
        steps=1,
    )
    pose = drive(PosePlane(calibration=CALIBRATION), centres=seen.centres[0], steps=1)
    found = craft(pose.position[0], (pose.roll[0], pose.pitch[0], pose.yaw[0]), offset=offset, angles=angles)
    assert found.position[0] == pytest.approx(POSITION, abs=1e-7)
    assert attitude_of(found) == pytest.approx(attitude, abs=1e-7)
