"""How well views determine a camera: standard deviations beside OpenCV's and beside scatter, and warnings."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from quadvis.errors import QuadvisError
from quadvis_vision.calibrate import chessboard
from quadvis_vision.calibrate.bundle import LENS as LENS_NAMES
from quadvis_vision.calibrate.bundle import adjust, free_parameters
from quadvis_vision.calibrate.deviations import (
    LEAST_NOISE,
    NAMES,
    Deviations,
    bundle_deviations,
    homogeneous_deviations,
)
from quadvis_vision.camera.homogeneous import calibrate
from tests.stages import mostly_slow

BOARD = chessboard.Board(9, 6, 0.025)
SIZE = (640, 480)
K = np.array([[536.0, 0, 342], [0, 530, 236], [0, 0, 1]])
LENS = np.array([-0.27, 0.05, 0.0018, -0.0003, 0.02])
MIDDLE = BOARD.points.mean(axis=0)


def look(turn, shift=(0.0, 0.0), distance=0.4, lens=LENS):
    """Return the corners (54, 2) of a board that is turned about its middle (degrees, axis times angle)."""
    points = np.column_stack([BOARD.points - MIDDLE, np.zeros(54)])
    seen = cv2.projectPoints(points, np.radians(turn), np.array([*shift, distance]), K, lens)[0]
    return np.reshape(seen, (-1, 2))


GOOD = [
    [(30, 0, 0), (-30, 0, 0), (0, 30, 0), (0, -30, 0)],
    [(20, 20, 0), (-20, 20, 10), (20, -20, 0), (-20, -20, 30), (0, 0, 0)],
    [(40, 5, 0), (-5, 40, 0), (-40, 0, 20), (5, -40, 0)],
    [(25, 0, 0), (0, 25, 0), (-25, 0, 0), (0, -25, 0), (18, 18, 0), (-18, -18, 0)],
    [(35, 10, 45), (-10, 35, 90), (-35, 10, 0), (10, -35, 120)],
    [(45, 0, 0), (0, 45, 0), (-30, 30, 0), (30, 30, 60)],
    [(30, 0, 0), (30, 0, 90), (30, 0, 180), (30, 0, 270)],
    [(15, 30, 0), (-30, 15, 0), (-15, -30, 0), (30, -15, 0)],
    [(50, 0, 0), (-50, 0, 0), (0, 50, 0), (0, -50, 0)],
    [(30, 30, 30), (-30, -30, -30), (30, -30, 0), (-30, 30, 0), (0, 0, 90)],
]
# Boards that are all turned the same way, or hardly turned, wherever they are.
POOR = [
    [(25, 5, 0)] * 5,
    [(10, 0, 0)] * 5,
    [(0, 20, 0)] * 4,
    [(20, 20, 0)] * 6,
    [(3, 0, 0), (-3, 0, 0), (0, 3, 0), (0, -3, 0)],
    [(30, 0, 0), (31, 0, 0), (29, 0, 0), (30, 1, 0), (30, -1, 0)],
    [(0, 0, 0), (2, 0, 0), (0, 2, 0)],
    [(0, 12, 0), (1, 12, 0), (-1, 12, 0), (0, 13, 0)],
    [(5, 5, 0), (5, 5, 30), (5, 5, 60), (5, 5, 90)],
    [(40, 0, 0)] * 3,
    [(15, -15, 20), (16, -15, 21), (14, -15, 19), (15, -14, 20)],
]
SHIFTS = [(0.0, 0.0), (0.06, 0.03), (-0.06, 0.03), (0.05, -0.04), (-0.05, -0.04), (0.0, 0.05)]


def views(turns, noise, seed=1):
    rng = np.random.default_rng(seed)
    ideal = [
        look(turn, shift, 0.42 + 0.02 * (index % 3))
        for index, (turn, shift) in enumerate(zip(turns, SHIFTS, strict=False))
    ]
    return [corners + rng.normal(0, noise, corners.shape) for corners in ideal]


def weighed(seen, skew=False):
    """Return the bundle and the deviations of views, with all of the lens."""
    bundle = adjust(BOARD.points, seen, SIZE, skew=skew)
    free = free_parameters(skew=skew, lens=LENS_NAMES)
    return bundle, bundle_deviations(bundle, BOARD.points, np.asarray(seen), free)


@pytest.mark.parametrize("case", range(len(GOOD)))
def test_standard_deviations_are_those_of_opencv(case):
    seen = views(GOOD[case], 0.2)
    _, ours = weighed(seen)
    board = np.column_stack([BOARD.points, np.zeros(54)]).astype(np.float32)
    pixels = [np.float32(corners).reshape(-1, 1, 2) for corners in seen]
    theirs = cv2.calibrateCameraExtended([board] * len(seen), pixels, SIZE, None, None)[5].ravel()[:9]
    assert list(ours.facts()) == [name for name in NAMES if name != "skew"]
    assert list(ours.facts().values()) == pytest.approx(theirs.tolist(), rel=2e-3)
    assert ours.noise == pytest.approx(0.2, rel=0.15)


def test_a_skew_that_is_found_has_a_deviation_too():
    seen = views(GOOD[1], 0.2)
    _, ours = weighed(seen, skew=True)
    assert 0 < ours.facts()["skew"] < 5


def test_deviations_are_what_repetitions_scatter_by():
    found, told = [], []
    for seed in range(60):
        bundle, deviations = weighed(views(GOOD[3], 0.3, seed))
        found.append(bundle.camera)
        told.append(deviations.camera)
    scatter, told = np.std(found, axis=0), np.mean(told, axis=0)
    for index in (0, 1, 2, 3):
        assert told[index] == pytest.approx(scatter[index], rel=0.3)


def solid(heights=(0.0, 0.1, 0.2, 0.3)):
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 6), np.linspace(-0.2, 0.2, 5))
    points = np.vstack([np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)]) for z in heights])
    pixels = cv2.projectPoints(points, np.array([np.pi, 0, 0]), np.array([0.02, 0.01, 1.0]), K, None)[0]
    return points, pixels.reshape(-1, 2)


def test_points_in_space_have_deviations_that_repetitions_scatter_by():
    points, pixels = solid()
    found, told = [], []
    for seed in range(200):
        noisy = pixels + np.random.default_rng(seed).normal(0, 0.3, pixels.shape)
        camera = calibrate(points, noisy)
        found.append([*camera.matrix[[0, 1, 0, 1, 0], [0, 1, 2, 2, 1]]])
        told.append(homogeneous_deviations(camera, points, noisy).camera[:5])
    assert np.mean(told, axis=0) == pytest.approx(np.std(found, axis=0), rel=0.25)
    assert np.isnan(homogeneous_deviations(camera, points, noisy).camera[5:]).all()


@pytest.mark.parametrize("noise", mostly_slow([0.1, 0.02, 0.2], slow=0))
@pytest.mark.parametrize("case", range(len(GOOD)))
def test_views_from_all_sides_need_no_warning(case, noise):
    assert weighed(views(GOOD[case], noise))[1].warning("these views", "tilt") == ""


@pytest.mark.parametrize("noise", mostly_slow([0.1, 0.02, 0.3], slow=0))
@pytest.mark.parametrize("case", range(len(POOR)))
def test_views_that_leave_the_camera_undetermined_are_told_whatever_their_residuals(case, noise):
    try:
        found = chessboard.calibrate_views(BOARD, views(POOR[case], noise), SIZE)
    except QuadvisError as error:  # so poor that there is no camera at all
        assert any(words in str(error) for words in ("tilted in several directions", "fold"))
        return
    said = found.deviations.warning("these views", "tilt the board more ways")
    assert said.startswith("these views leave the camera undetermined: errors of 0.")
    assert "fx by" in said and said.endswith("; tilt the board more ways")


@pytest.mark.parametrize("heights", [(0.0, 0.002), (0.0, 0.001, 0.002), (0.1, 0.105)])
def test_points_at_almost_one_depth_are_told(heights):
    points, pixels = solid(heights)
    noisy = pixels + np.random.default_rng(0).normal(0, 0.1, pixels.shape)
    said = homogeneous_deviations(calibrate(points, noisy), points, noisy).warning(
        "these points", "spread them"
    )
    assert said.startswith("these points leave the camera undetermined")


def test_points_without_noise_are_weighed_by_what_noise_would_do():
    for heights, weak in (((0.0, 0.3), False), ((0.0, 0.002), True)):
        points, pixels = solid(heights)
        found = homogeneous_deviations(calibrate(points, pixels), points, pixels)
        assert found.noise < 1e-6
        assert bool(found.warning("these points", "spread them")) == weak


def test_a_warning_names_what_is_weak_and_only_that():
    per_pixel = np.array([1.0, 21.0, 1.0, np.inf, np.nan, 9, 9, 9, 9, 9])
    said = Deviations(per_pixel, 0.01, 500.0).warning("these views", "tilt the board")
    assert f"errors of {LEAST_NOISE} px" in said
    assert "fy by 5.2 px (1.1% of the focal length), cy by any amount; tilt" in said
    assert "fx" not in said and "cx" not in said and "k1" not in said
