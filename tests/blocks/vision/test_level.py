"""The levelled pose against poses that are known and conics that are projected here."""

import itertools
import math

import cv2
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadvis_vision.pose import level
from quadvis_vision.pose.level import level_covariance
from quadvis_vision.pose.refine import Unknowns
from tests.blocks.vision.plain import circles_at, full

SIDE = 1.3
CORNERS = np.array([[-1.0, 1], [1, 1], [1, -1], [-1, -1]]) * SIDE / 2
SUBSETS = [rows for count in (2, 3, 4) for rows in itertools.combinations(range(4), count)]

poses = st.tuples(
    *(st.floats(-2, 2),) * 2,  # x, y
    st.floats(2, 15),  # z
    *(st.floats(-0.5, 0.5),) * 2,  # roll, pitch
    st.floats(-3.1, 3.1),  # yaw
)


def homography(pose):
    """From the target's plane, forward and right, to normalised points, by OpenCV's rotation vectors."""
    *position, roll, pitch, yaw = pose
    turns = (np.array([roll, 0.0, 0]), np.array([0, pitch, 0.0]), np.array([0, 0.0, yaw]))
    rx, ry, rz = (cv2.Rodrigues(turn)[0] for turn in turns)
    turn = np.diag([1.0, -1.0, -1.0]) @ (rz @ ry @ rx).T
    return np.column_stack((turn[:, 0], turn[:, 1], -turn @ position))


def ellipse_centres(h, radius):
    """From the dual conic of each circle: the centre of a conic is the pole of the line at infinity."""
    centres = []
    for x, y in CORNERS:
        conic = np.array([[1, 0, -x], [0, 1, -y], [-x, -y, x * x + y * y - radius * radius]])
        dual = h @ np.linalg.inv(conic) @ h.T
        centres.append(dual[:2, 2] / dual[2, 2])
    return np.array(centres)


def exact_points(pose, radius=0.0):
    h = homography(pose)
    corners = np.column_stack((CORNERS, np.ones(4))) @ h.T
    return ellipse_centres(h, radius) if radius else corners[:, :2] / corners[:, 2:]


def level_pose(points, roll, pitch, radius=0.0):
    """x, y, z, yaw from points (4, 2)."""
    found = level.level_pose(circles_at(points, CORNERS), roll, pitch, radius)
    assert found is None or found[4:] == (roll, pitch)
    return None if found is None else found[:4]


def only(points, rows):
    left = np.full((4, 2), np.nan)
    left[list(rows)] = points[list(rows)]
    return left


@pytest.mark.parametrize("radius", [0.0, 0.15])
@pytest.mark.parametrize("rows", SUBSETS)
@given(pose=poses)
def test_exact_points_of_two_circles_or_more_give_the_pose_back(rows, radius, pose):
    x, y, z, roll, pitch, yaw = pose
    assume((np.column_stack((CORNERS, np.ones(4))) @ homography(pose)[2]).min() > 0.5)
    points = only(exact_points(pose, radius), rows)
    found = level_pose(points, roll, pitch, radius)
    # Two corrections for the radius leave a hundredth of a millimetre, for two circles near by at 40 degrees.
    assert found == pytest.approx((x, y, z, yaw), abs=1e-5 if radius else 1e-9)


def test_without_its_radius_a_circle_is_taken_for_a_point_and_the_pose_is_off():
    pose = (0.3, -0.2, 2.0, 0.2, -0.3, 0.5)
    points = exact_points(pose, 0.15)
    off = np.array(level_pose(points, 0.2, -0.3)) - (*pose[:3], pose[5])
    assert 1e-3 < np.abs(off).max() < 0.05


def test_the_fit_is_the_least_squares_solution_of_the_eight_linear_equations():
    rng = np.random.default_rng(3)
    for _ in range(20):
        pose = (*rng.uniform(-1, 1, 2), rng.uniform(2, 6), *rng.uniform(-0.3, 0.3, 2), rng.uniform(-3, 3))
        roll, pitch = pose[3:5]
        points = exact_points(pose) + rng.normal(0, 5e-3, (4, 2))
        turns = [cv2.Rodrigues(turn)[0] for turn in np.diag([roll, pitch, 0.0])]
        level = np.column_stack((points, np.ones(4))) * (1, -1, -1) @ (turns[1] @ turns[0]).T
        m = level[:, :2] / -level[:, 2:]
        rows = [row for x, y in CORNERS for row in ((x, -y, 1, 0), (y, x, 0, 1))]
        (a, b, *c), *_ = np.linalg.lstsq(np.array(rows), m.ravel())
        x, y = -np.linalg.solve([[a, -b], [b, a]], c)
        expected = (x, y, 1 / math.hypot(a, b), math.atan2(-b, a))
        assert level_pose(points, roll, pitch) == pytest.approx(expected, rel=1e-9)


def test_a_craft_that_is_tilted_only_in_what_it_is_told_seems_beside_the_target():
    points = exact_points((0, 0, 3.0, 0, 0, 0))
    # Told that its right side is down, it takes what it sees overhead for something to its right ...
    assert level_pose(points, 0.1, 0.0)[1] == pytest.approx(-0.3, abs=0.02)
    # ... and told that its nose is up, for something behind it.
    assert level_pose(points, 0.0, 0.1)[0] == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("rows", SUBSETS)
def test_the_covariance_is_how_the_pose_follows_its_measurements(rows):
    rng = np.random.default_rng(7)
    rows, lens = list(rows), np.array([[430.0, 20], [5, 470]])
    for _ in range(5):
        tilt, yaw = rng.uniform(-0.4, 0.4, 2), rng.uniform(-3, 3)
        pose = (*rng.uniform(-1, 1, 2), rng.uniform(3, 6), *tilt, yaw)
        exact = exact_points(pose)

        def solve(measured, exact=exact, tilt=tilt):
            # Pixels and angles in standard deviations, 0.3 px and 0.01 rad, from the exact ones.
            pixels = 0.3 * measured[:8].reshape(4, 2) @ np.linalg.inv(lens).T
            return np.array(level_pose(only(exact + pixels, rows), *(tilt + 0.01 * measured[8:])))

        steps = 0.01 * np.eye(10)
        slopes = np.array([(solve(step) - solve(-step)) / 0.02 for step in steps]).T
        expected = slopes @ slopes.T
        scale = np.sqrt(np.diag(expected))
        circles = circles_at(exact[rows], CORNERS[rows], np.tile(lens / 0.3, (len(rows), 1, 1)))
        found = full(level_covariance(circles, Unknowns(*pose[:3], yaw, *tilt), 0.01), 4)
        assert found / np.outer(scale, scale) == pytest.approx(expected / np.outer(scale, scale), abs=1e-5)


@pytest.mark.parametrize("rows", [(), (0,), (3,)])
def test_fewer_than_two_circles_give_no_pose(rows):
    assert level_pose(only(exact_points((0, 0, 3.0, 0, 0, 0)), rows), 0.0, 0.0) is None


def test_points_below_the_horizon_and_circles_in_one_place_give_no_pose():
    points = exact_points((0, 0, 3.0, 0, 0, 0))
    assert level_pose(points, 3.0, 0.0) is None
    assert level_pose(np.tile(points[:1], (4, 1)), 0.0, 0.0) is None


def test_a_camera_above_its_target_has_no_covariance():
    circles = circles_at(np.zeros((4, 2)), CORNERS)
    assert level_covariance(circles, Unknowns(0.0, 0.0, -3.0, 0.0, 0.0, 0.0), 0.01) == []


@given(
    points=arrays(np.float64, (4, 2), elements=st.floats(width=64)),
    tilt=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)),
    radius=st.floats(0, 10),
)
def test_no_points_raise_an_error(points, tilt, radius):
    found = level_pose(points, *tilt, radius)
    assert found is None or len(found) == 4
