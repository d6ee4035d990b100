"""Gauss-Newton against OpenCV's refinement, numerical derivatives, and a sum of squares written out here."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadvis_vision.pose import level
from quadvis_vision.pose.pose import Pose, pose_from_plane
from quadvis_vision.pose.refine import Estimate, Tilt, Unknowns, pose_of, unknowns_of
from quadvis_vision.pose.refine import refine as refine_circles
from tests.blocks.vision.plain import arrays_of, circles_at, full, pose_by

SIDE = 1.0
CORNERS = np.array([[-0.5, 0.5, 0], [0.5, 0.5, 0], [0.5, -0.5, 0], [-0.5, -0.5, 0]])
MATRIX = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])
WEIGHTS = np.tile(MATRIX[:2, :2], (4, 1, 1))
SIGMA = math.radians(0.5)


def project(unknowns):
    """Normalised points (4, 2) for x, y, z, yaw, roll, pitch, by OpenCV's rotation vectors."""
    x, y, z, yaw, roll, pitch = unknowns
    rx, ry, rz = (cv2.Rodrigues(turn)[0] for turn in np.diag([roll, pitch, yaw]))
    points = (CORNERS - (x, y, z)) @ (np.diag([1.0, -1.0, -1.0]) @ (rz @ ry @ rx).T).T
    return points[:, :2] / points[:, 2:]


def cost(unknowns, points, tilt=None, noise=1.0):
    """The sum of squares that is to be least."""
    picture = (project(unknowns) - points) @ MATRIX[:2, :2].T / noise
    prior = 0 if tilt is None else ((unknowns[4:] - np.array(tilt[:2])) ** 2).sum() / tilt[2] ** 2
    return (picture**2).sum() + prior


def draw(rng, noise):
    """Random unknowns, and what is seen of them with noise in px."""
    tilts = rng.uniform(-0.2, 0.2, 2)
    unknowns = np.array([*rng.uniform(-0.7, 0.7, 2), rng.uniform(1.5, 5), rng.uniform(-3, 3), *tilts])
    return unknowns, project(unknowns) + rng.normal(0, noise, (4, 2)) / 435


def refine(points, weights, start, tilt=None):
    """Unknowns (6,) and covariance (6, 6) from points (n, 2)."""
    found = refine_circles(
        circles_at(points, CORNERS[: len(points)], weights), 0.0, Unknowns(*np.asarray(start).tolist()), tilt
    )
    return None if found is None else Estimate(np.array(found.unknowns), full(found.covariance, 6))


def level_pose(points, tilt):
    return level.level_pose(circles_at(points, CORNERS), *tilt)


def from_plane(points):
    return unknowns_of(pose_by(pose_from_plane, np.column_stack((points, np.ones(4))), SIDE))


def from_opencv(turn, shift):
    turn, _ = cv2.Rodrigues(turn)
    return unknowns_of(Pose(turn, -turn.T @ np.ravel(shift)))


def numerical_jacobian(function, place, step):
    columns = [
        (function(place + step * e) - function(place - step * e)) / (2 * step) for e in np.eye(len(place))
    ]
    return np.array(columns).T


def test_from_beside_it_exact_points_lead_to_the_pose():
    rng = np.random.default_rng(1)
    for _ in range(50):
        truth, points = draw(rng, 0)
        start = truth + rng.normal(0, [0.05, 0.05, 0.1, 0.05, 0.03, 0.03])
        found = refine(points, WEIGHTS, start)
        assert found.unknowns == pytest.approx(truth, abs=1e-6)


def test_the_pose_of_the_paper_refined_is_where_opencv_s_refinements_end():
    rng = np.random.default_rng(2)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-15)
    for _ in range(50):
        _, points = draw(rng, 0.3)
        start = pose_by(pose_from_plane, np.column_stack((points, np.ones(4))), SIDE)
        # OpenCV weighs x and y alike and knows no skew.
        found = refine(points, np.tile(430 * np.eye(2), (4, 1, 1)), unknowns_of(start)).unknowns
        turn, shift = cv2.Rodrigues(start.rotation)[0], -(start.rotation @ start.position)[:, None]
        virtual = cv2.solvePnPRefineVVS(
            CORNERS, points, np.eye(3), None, turn.copy(), shift.copy(), criteria, 1
        )
        assert found == pytest.approx(from_opencv(*virtual), abs=2e-4)
        marquardt = cv2.solvePnPRefineLM(CORNERS, points, np.eye(3), None, turn, shift)  # ends a little early
        distances = [
            ((project(unknowns) - points) ** 2).sum() for unknowns in (found, from_opencv(*marquardt))
        ]
        assert distances[0] <= distances[1] * (1 + 1e-6)


@pytest.mark.parametrize("tilted", [False, True])
def test_no_pose_near_by_has_a_smaller_sum_of_squares(tilted):
    rng = np.random.default_rng(3)
    for _ in range(20):
        truth, points = draw(rng, 0.4)
        tilt = Tilt(*(truth[4:] + rng.normal(0, SIGMA, 2)), SIGMA) if tilted else None
        start = np.array(level_pose(points, tilt[:2])) if tilted else from_plane(points)
        found = refine(points, WEIGHTS / 0.4, start, tilt)
        least = cost(found.unknowns, points, tilt, 0.4)
        assert least <= cost(start, points, tilt, 0.4)
        deviations = np.linalg.cholesky(found.covariance)
        for _ in range(50):
            other = found.unknowns + deviations @ rng.normal(0, 0.05, 6)
            assert cost(other, points, tilt, 0.4) > least - 1e-6


def test_a_tilt_that_is_sure_stays_and_one_that_is_not_says_nothing():
    rng = np.random.default_rng(4)
    for _ in range(20):
        truth, points = draw(rng, 0.2)
        roll, pitch = truth[4:] + rng.normal(0, SIGMA, 2)
        seen = points, WEIGHTS / 0.2
        sure = refine(*seen, truth, Tilt(roll, pitch, 1e-7))
        assert sure.unknowns[4:] == pytest.approx((roll, pitch), abs=1e-7)
        unsure, alone = refine(*seen, truth, Tilt(roll, pitch, 1e3)), refine(*seen, truth)
        assert unsure.unknowns == pytest.approx(alone.unknowns, abs=1e-4)


def test_two_circles_leave_the_measured_tilt_as_it_is_and_are_met_exactly():
    truth, points = draw(np.random.default_rng(5), 0.5)
    tilt = Tilt(truth[4] + 0.01, truth[5] - 0.01, SIGMA)
    found = refine(points[:2], WEIGHTS[:2], truth, tilt).unknowns
    assert found[4:] == pytest.approx(tilt[:2], abs=1e-7)
    assert project(found)[:2] == pytest.approx(points[:2], abs=1e-7)
    half = np.vstack((points[:2], np.full((2, 2), np.nan)))
    assert found[:4] == pytest.approx(level_pose(half, tilt[:2])[:4], abs=1e-6)


@pytest.mark.parametrize("tilted", [False, True])
def test_the_covariance_is_how_the_pose_follows_its_measurements(tilted):
    rng = np.random.default_rng(6)
    for _ in range(5):
        truth, points = draw(rng, 0)

        def solve(measured, truth=truth, points=points):
            # Pixels and angles in standard deviations, from the exact ones.
            pixels = 0.3 * measured[:8].reshape(4, 2) @ np.linalg.inv(MATRIX[:2, :2]).T
            tilt = Tilt(*(truth[4:] + SIGMA * measured[8:]), SIGMA) if tilted else None
            return refine(points + pixels, WEIGHTS / 0.3, truth, tilt).unknowns

        slopes = numerical_jacobian(solve, np.zeros(10), 0.02)
        expected = slopes @ slopes.T
        scale = np.sqrt(np.diag(expected))
        covariance = refine(
            points, WEIGHTS / 0.3, truth, Tilt(*truth[4:], SIGMA) if tilted else None
        ).covariance
        assert covariance / np.outer(scale, scale) == pytest.approx(
            expected / np.outer(scale, scale), abs=0.01
        )


def test_poses_and_unknowns_are_one():
    rng = np.random.default_rng(8)
    for _ in range(20):
        truth, points = draw(rng, 0)
        pose = arrays_of(pose_of(Unknowns(*truth)))
        assert unknowns_of(pose) == pytest.approx(truth, abs=1e-12)
        image = (CORNERS - pose.position) @ pose.rotation.T
        assert image[:, :2] / image[:, 2:] == pytest.approx(points, abs=1e-12)


def test_what_determines_no_pose_gives_none():
    _, points = draw(np.random.default_rng(9), 0)
    above = unknowns_of(Pose(np.eye(3), np.array([0.0, 0, 2])))  # the camera looks away from the target
    assert refine(points, WEIGHTS, above) is None


@given(
    points=arrays(np.float64, (4, 2), elements=st.floats(width=64)),
    start=arrays(np.float64, 6, elements=st.floats(-1e6, 1e6)),
    tilt=st.tuples(st.floats(-10, 10), st.floats(-10, 10), st.floats(1e-9, 1e3)),
)
def test_no_view_raises_an_error(points, start, tilt):
    for found in (refine(points, WEIGHTS, start), refine(points, WEIGHTS, start, Tilt(*tilt))):
        assert found is None or np.isfinite(found.unknowns).all()
