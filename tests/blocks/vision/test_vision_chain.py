"""From the rendered camera over the circles to the pose: the conventions of all of them together."""

import math
from pathlib import Path

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.vision.circle_detector import CircleDetector
from quadvis_blocks.vision.pose_n_points import PoseNPoints
from quadvis_blocks.vision.pose_plane import PosePlane
from quadvis_blocks.vision.rendered_camera import RenderedCamera

CALIB = Path(__file__).parents[3] / "diagrams/calib"
CAMERA = str(CALIB / "camera.yaml")
CEILING = 4.5


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
def test_the_pose_of_the_craft_comes_back_from_its_pictures(method):
    k = np.arange(20)
    position = np.column_stack((0.2 * np.sin(0.3 * k), 0.1 * np.cos(0.2 * k), 1.2 + 0.01 * k))
    attitude = np.column_stack((0.05 * np.sin(0.4 * k), 0.04 * np.cos(0.5 * k), 0.3 * k - 2))
    camera = RenderedCamera(calibration=CAMERA, ceiling=CEILING)
    pictures = drive(camera, position=position, attitude=attitude, rate="10 Hz").frame
    circles = drive(CircleDetector(colours=str(CALIB / "colours.yaml")), frame=pictures, rate="10 Hz")
    assert circles.found.all() and (circles.sequence == k + 1).all()
    pose = drive(method(calibration=CAMERA), centres=circles.centres, rate="10 Hz")
    assert pose.valid.all()
    # Four times what a centroid error of 0.05 px makes of it; yaw and z suffer far less than the tilt.
    truth = position * (1, 1, -1) + (0, 0, CEILING)
    assert np.abs(pose.position - truth).max() < 0.05
    assert np.abs(np.column_stack((pose.roll, pose.pitch)) - attitude[:, :2]).max() < 0.015
    errors = [math.remainder(a - b, 2 * math.pi) for a, b in zip(pose.yaw, attitude[:, 2], strict=True)]
    assert max(map(abs, errors)) < 2e-3
    assert pose.residual.max() < 0.1
