"""Figure 3 of the paper: its two methods, its poses, and what OpenCV makes of the same points."""

import itertools

import cv2
import numpy as np
import pytest

from quadvis_vision.camera.projection import camera_attitude
from quadvis_vision.pose.level import level_pose
from quadvis_vision.pose.pose import pose_from_n_points, pose_from_plane
from tests.blocks.vision.plain import circles_at, pose_by

# x, y, z and three angles in degrees. One heading misprints the method, and one number: "-0-2" is -0.2.
FIRST = np.array([
    [0.5, -1.1, 21.2, 10.5, 2.4, -6.9],
    [2.6, -1.0, 33.6, 8.8, -0.2, -4.7],
    [0.7, -5.3, 31.6, 19.3, -0.3, -3.9],
    [8.3, -1.8, 33.5, 15.9, -6.3, 7.5],
])  # fmt: skip
SECOND = np.array([
    [0.6, -1.1, 18.5, 9.2, 1.6, -8.6],
    [2.8, -1.1, 29.1, 7.9, -0.3, -3.3],
    [0.9, -5.6, 27.9, 18.5, -0.1, -4.3],
    [9.0, -1.8, 30.1, 16.7, -5.0, 6.0],
])  # fmt: skip
MATRIX = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])  # (38)
SIDE = 6.0  # the paper does not give it
METHODS = (pose_from_n_points, pose_from_plane)
CORNERS = np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * SIDE / 2


def rotation(roll, pitch, yaw):
    """From target to camera axes, by OpenCV's rotation vectors."""
    turns = (np.array([roll, 0, 0]), np.array([0, pitch, 0]), np.array([0, 0, yaw]))
    rx, ry, rz = (cv2.Rodrigues(turn)[0] for turn in turns)
    return np.diag([1.0, -1.0, -1.0]) @ (rz @ ry @ rx).T


def camera_points(position, angles):
    return (CORNERS - position) @ rotation(*angles).T


def to_rays(pixels, matrix=MATRIX):
    return np.linalg.solve(matrix, np.column_stack((pixels, np.ones(len(pixels)))).T).T


def to_pixels(points, matrix=MATRIX):
    image = points @ matrix.T
    return image[:, :2] / image[:, 2:]


def by_opencv(rays, flags):
    """Return (rotation, position) of cv2.solvePnP on normalised points; it ignores a skew in K."""
    ok, turn, shift = cv2.solvePnP(CORNERS, rays[:, :2] / rays[:, 2:], np.eye(3), None, flags=flags)
    assert ok
    turn, _ = cv2.Rodrigues(turn)
    return turn, -turn.T @ shift[:, 0]


def test_the_published_methods_differ_by_this_much():
    rms = np.sqrt(((FIRST - SECOND) ** 2).mean(axis=0))
    assert rms == pytest.approx([0.381, 0.158, 3.633, 0.972, 0.771, 1.347], abs=1e-3)
    ratios = FIRST[:, 2] / SECOND[:, 2]
    assert ratios == pytest.approx([1.146, 1.155, 1.133, 1.113], abs=1e-3)
    assert ratios.mean() == pytest.approx(1.137, abs=1e-3)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("published", [FIRST, SECOND])
@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_exact_points_give_the_published_poses_back(method, published, order):
    # The columns' names cannot be read, so every way to take them as roll, pitch and yaw must do.
    for row in published:
        angles = np.radians(row[3:])[list(order)]
        pose = pose_by(method, to_rays(to_pixels(camera_points(row[:3], angles))), SIDE)
        assert pose.position == pytest.approx(row[:3], abs=1e-7)
        found = camera_attitude(pose.rotation.tolist())
        assert found == pytest.approx(angles, abs=1e-7)


@pytest.mark.parametrize("published", [FIRST, SECOND])
def test_two_circles_and_the_tilt_give_the_published_poses_back_too(published):
    for row in published:
        yaw, pitch, roll = np.radians(row[3:])
        rays = to_rays(to_pixels(camera_points(row[:3], (roll, pitch, yaw))))
        points = rays[:, :2] / rays[:, 2:]
        for rows in itertools.combinations(range(4), 2):
            seen = np.full((4, 2), np.nan)
            seen[list(rows)] = points[list(rows)]
            found = level_pose(circles_at(seen, CORNERS), roll, pitch)
            assert found == pytest.approx((*row[:3], yaw, roll, pitch), abs=1e-7)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("flags", [cv2.SOLVEPNP_IPPE, cv2.SOLVEPNP_ITERATIVE])
def test_opencv_finds_the_same_poses_in_exact_points(method, flags):
    for row in FIRST:
        rays = to_rays(to_pixels(camera_points(row[:3], np.radians(row[[5, 4, 3]]))))
        turn, position = by_opencv(rays, flags)
        pose = method(rays, SIDE)
        assert pose.rotation == pytest.approx(turn, abs=1e-5)
        assert pose.position == pytest.approx(position, abs=1e-3)


def test_the_distance_of_the_first_method_is_the_longer_focal_lengths_in_part():
    # (36) and (37) hold focal lengths of 457.6 and 455.5 px, (38) 430 and 438: one camera cannot have both.
    longer = MATRIX.copy()
    longer[0, 0], longer[1, 1] = 457.6, 455.5
    for row in SECOND:
        pixels = to_pixels(camera_points(row[:3], np.radians(row[[5, 4, 3]])))
        for method in METHODS:
            ratio = (
                pose_by(method, to_rays(pixels, longer), SIDE).position[2]
                / pose_by(method, to_rays(pixels), SIDE).position[2]
            )
            assert ratio == pytest.approx(1.052, abs=0.02)  # of the published 1.137


def test_noise_hurts_both_methods_alike_as_much_as_ippe_and_more_than_minimising_in_the_picture():
    rng = np.random.default_rng(1)
    errors = []
    while len(errors) < 500:
        position = np.array([rng.uniform(-9, 9), rng.uniform(-6, 6), rng.uniform(18, 34)])
        angles = np.radians(rng.uniform((-9, -9, -20), (9, 9, 20)))
        pixels = to_pixels(camera_points(position, angles))
        if not ((pixels > 0) & (pixels < (452, 322))).all():
            continue
        rays = to_rays(pixels + rng.normal(0, 0.5, (4, 2)))
        found = [method(rays, SIDE).position for method in METHODS]
        found += [by_opencv(rays, flags)[1] for flags in (cv2.SOLVEPNP_IPPE, cv2.SOLVEPNP_ITERATIVE)]
        errors.append([np.hypot(*(p - position)[:2]) for p in found])
    first, second, ippe, iterative = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    # An independent study of other random poses found 2.41, 2.40, 2.49 and 1.82 units in the plane.
    assert first == pytest.approx(2.4, rel=0.25)
    assert second == pytest.approx(first, rel=0.02)
    assert first == pytest.approx(ippe, rel=0.15)
    assert 1.2 < second / iterative < 1.7
