"""Method 2 against OpenCV's homography and numpy's singular value decomposition; what both methods share is
tested in test_pose_n_points.py."""

import cv2
import numpy as np
import pytest

from quadvis_vision.pose.pose import pose_from_n_points, pose_from_plane
from tests.blocks.vision.plain import pose_by

CORNERS = np.array([[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]])


def noisy_rays(rng, sigma):
    """Rays to the corners of a square of side 1, from a camera that is tilted and turned, with noise."""
    turn, _ = cv2.Rodrigues(rng.uniform(-0.3, 0.3, 3))
    turn = np.diag([1.0, -1.0, -1.0]) @ cv2.Rodrigues(np.array([0, 0, rng.uniform(-3, 3)]))[0] @ turn
    points = (
        np.column_stack((CORNERS, np.zeros(4))) - (*rng.uniform(-0.5, 0.5, 2), rng.uniform(2, 6))
    ) @ turn.T
    return np.column_stack((points[:, :2] / points[:, 2:] + rng.normal(0, sigma, (4, 2)), np.ones(4)))


def test_it_is_the_published_formula_with_its_misprints_corrected():
    rng = np.random.default_rng(1)
    for _ in range(50):
        rays = noisy_rays(rng, 2e-3)
        a = cv2.getPerspectiveTransform(CORNERS.astype(np.float32), rays[:, :2].astype(np.float32))
        a *= np.sign(a[2, 2])
        u, s, vt = np.linalg.svd(a[:, :2], full_matrices=False)
        n = u @ vt
        n3 = np.column_stack((n, np.cross(n[:, 0], n[:, 1])))
        mu = s.sum() / (s**2).sum()
        w = n3.T @ a @ (0, 0, mu)
        pose = pose_by(pose_from_plane, rays, 1.0)
        assert pose is not None
        # getPerspectiveTransform takes single precision.
        assert pose.rotation == pytest.approx(n3, abs=1e-5)
        assert pose.position == pytest.approx(-w, abs=1e-4)


def test_no_other_rotation_is_nearer_to_the_homography():
    rng = np.random.default_rng(2)
    for _ in range(20):
        rays = noisy_rays(rng, 5e-3)
        pose = pose_by(pose_from_plane, rays, 1.0)
        a = cv2.findHomography(CORNERS, rays[:, :2])[0]
        a *= np.sign(a[2, 2])

        def distance(rotation, a=a):
            # The best scale goes with every rotation, so only the rotation counts.
            n = rotation[:, :2]
            return np.linalg.norm(a[:, :2] / np.trace(n.T @ a[:, :2]) - n / 2)

        least = distance(pose.rotation)
        for _ in range(20):
            other = cv2.Rodrigues(rng.normal(0, 1e-3, 3))[0] @ pose.rotation
            assert distance(other) > least


def test_the_two_methods_differ_in_distance_alone():
    rng = np.random.default_rng(3)
    differences = []
    for _ in range(100):
        rays = noisy_rays(rng, 2e-3)
        first, second = pose_by(pose_from_n_points, rays, 1.0), pose_by(pose_from_plane, rays, 1.0)
        assert first.rotation == pytest.approx(second.rotation, abs=1e-12)
        scale = first.position[2] / second.position[2]
        assert first.position == pytest.approx(scale * second.position, rel=1e-9)
        differences.append(scale - 1)
    assert 1e-4 < np.std(differences) < 0.05
