import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis.testing import Driven, drive
from quadvis_blocks.estimation.camera_tilt import CameraTilt
from quadvis_blocks.vision.geometric_camera import GeometricCamera
from quadvis_blocks.vision.pose_imu import PoseImu

CALIBRATION = str(Path(__file__).parents[3] / "diagrams" / "calib" / "camera.yaml")
ANGLES = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3.0, 3.0))


def tilt(roll: float, pitch: float, angles: Any = (0.0, 0.0, 0.0)) -> Driven:
    return drive(CameraTilt(angles=angles), roll=roll, pitch=pitch, steps=1)


def turn(angles: Any) -> Rotation:
    return Rotation.from_euler("ZYX", np.asarray(angles)[::-1])


def test_without_a_mount_the_tilt_is_that_of_the_craft_to_the_bit() -> None:
    found = tilt(0.1, -0.2)
    assert (found.camera_roll[0], found.camera_pitch[0]) == (0.1, -0.2)


def test_a_camera_turned_by_a_quarter_to_the_right_rolls_as_the_craft_pitches() -> None:
    found = tilt(0.02, 0.05, (0.0, 0.0, math.pi / 2))
    assert found.camera_roll[0] == pytest.approx(0.05, abs=1e-4)
    assert found.camera_pitch[0] == pytest.approx(-0.02, abs=1e-4)


@given(ANGLES, ANGLES)
def test_it_is_the_tilt_of_the_mounted_camera_at_any_heading(attitude: Any, mount: Any) -> None:
    _, pitch, roll = (turn(attitude) * turn(mount)).as_euler("ZYX")
    found = tilt(attitude[0], attitude[1], mount)
    assert (found.camera_roll[0], found.camera_pitch[0]) == pytest.approx((roll, pitch), abs=1e-9)


def test_a_missing_tilt_stays_missing() -> None:
    for mount in ((0.0, 0.0, 0.0), (0.1, 0.0, 0.3)):
        assert np.isnan(tilt(math.nan, 0.1, mount).camera_roll[0])


def test_the_levelled_pose_is_right_with_the_tilt_of_the_camera() -> None:
    position, attitude, mount = np.array((0.3, -0.2, 1.5)), (0.03, -0.02, 0.5), (0.06, -0.05, 0.4)
    camera = (turn(attitude) * turn(mount)).as_euler("ZYX")[::-1]
    seen = drive(
        GeometricCamera(calibration=CALIBRATION, noise=0.0), position=position, attitude=camera, steps=1
    )

    def place(tilted: Driven) -> Any:
        angles = {"imu_roll": tilted.camera_roll[0], "imu_pitch": tilted.camera_pitch[0]}
        block = PoseImu(calibration=CALIBRATION, mode="level")
        return drive(block, centres=seen.centres[0], **angles, steps=1).position[0]

    right = np.array((0.3, -0.2, 3.0))
    assert place(tilt(attitude[0], attitude[1], mount)) == pytest.approx(right, abs=1e-6)
    assert np.abs(place(tilt(attitude[0], attitude[1])) - right).max() > 0.1
