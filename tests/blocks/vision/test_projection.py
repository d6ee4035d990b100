"""Where the upward camera sees the target: signs derived by hand, circles against dense outlines."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.projection import (
    camera_attitude,
    camera_point,
    camera_pose,
    camera_rotation,
    circle_outline,
    ellipse_centre,
    target_corners,
)

CEILING = 4.5
CAMERA = CameraCalibration.load(Path(__file__).parents[3] / "diagrams" / "calib" / "camera.yaml")

positions = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 3))
attitudes = st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-3.1, 3.1))


def seen(position: tuple[float, ...] = (0, 0, 1.5), attitude: tuple[float, ...] = (0, 0, 0)) -> np.ndarray:
    """Return the pixels of the circle centres."""
    turn, shift = camera_pose(position, attitude, CEILING)
    return CAMERA.project(target_corners(1.0) @ turn.T + shift)


def test_a_level_craft_under_the_target_sees_the_square_of_the_pinhole_formula() -> None:
    # 3 m below circles at +-0.5 m: fx 0.5 / 3 = 71.667, fy 0.5 / 3 = 73, skew 2 * 0.5 / 3 = 1/3.
    expected = [
        [226 - 71.6667 - 0.3333, 161 - 73],
        [226 + 71.6667 - 0.3333, 161 - 73],
        [226 + 71.6667 + 0.3333, 161 + 73],
        [226 - 71.6667 + 0.3333, 161 + 73],
    ]
    assert seen() == pytest.approx(np.array(expected), abs=1e-3)


@pytest.mark.parametrize(
    ("position", "attitude", "move"),
    [
        (
            (0.1, 0, 1.5),
            (0, 0, 0),
            (-1, 0),
        ),  # forward: the target falls back, and back is left in the picture
        ((0, 0.1, 1.5), (0, 0, 0), (0, 1)),  # to the right: it falls to the left side, which is down
        ((0, 0, 1.5), (0, 0.1, 0), (1, 0)),  # nose up: the camera looks backward, the target appears ahead
        ((0, 0, 1.5), (0.1, 0, 0), (0, 1)),  # right side down: it looks to the right, the target appears left
    ],
)
def test_the_target_moves_the_other_way(
    position: tuple[float, ...], attitude: tuple[float, ...], move: tuple[int, int]
) -> None:
    shift = (seen(position, attitude) - seen()).mean(axis=0)
    assert shift @ np.array(move) > 10
    assert abs(shift @ np.array(move[::-1])) < 1


def test_a_climb_makes_the_square_larger() -> None:
    assert np.ptp(seen((0, 0, 2.5))[:, 1]) == pytest.approx(438 / 2.0)


def test_a_quarter_turn_to_the_right_moves_each_circle_one_corner_clockwise() -> None:
    # The craft then faces the world's right: circle 2, ahead and right of it before, is ahead and left of it,
    # which is lower right in the picture.
    before, after = seen(), seen(attitude=(0, 0, math.pi / 2))
    assert after == pytest.approx(np.roll(before, -1, axis=0), abs=2.5)


def test_tilt_shifts_the_picture_by_the_tangent_of_the_angle() -> None:
    _, shift = camera_pose((0, 0, 1.5), (0, 0.2, 0), CEILING)
    middle = CAMERA.project([shift])
    assert middle[0] == pytest.approx([226 + 430 * math.tan(0.2), 161])


def test_the_camera_stands_where_the_craft_is() -> None:
    turn, shift = camera_pose((0.3, -0.2, 1.5), (0.1, -0.2, 0.7), CEILING)
    assert -turn.T @ shift == pytest.approx([0.3, -0.2, 3.0])


@given(attitudes)
def test_the_rotation_undoes_yaw_pitch_and_roll_and_looks_up(attitude: tuple[float, ...]) -> None:
    phi, theta, psi = attitude

    def about(axis: int, angle: float) -> np.ndarray:
        # Rodrigues' formula: I + sin K + (1 - cos) K^2.
        skew = np.cross(np.eye(3), np.eye(3)[axis])
        return np.eye(3) + math.sin(angle) * skew + (1 - math.cos(angle)) * skew @ skew

    body = about(2, psi) @ about(1, theta) @ about(0, phi)
    turn = camera_rotation(phi, theta, psi)
    assert np.allclose(turn, np.diag([1.0, -1.0, -1.0]) @ body.T, atol=1e-14)
    assert np.allclose(camera_attitude(turn), attitude, atol=1e-12)


@given(positions, attitudes, st.floats(-2, 2), st.floats(-2, 2))
def test_the_pose_of_the_camera_puts_the_points_of_the_target_into_its_axes(
    position: tuple[float, ...], attitude: tuple[float, ...], forward: float, right: float
) -> None:
    turn, shift = camera_pose(position, attitude, CEILING)
    assert np.allclose(-turn.T @ shift, (*position[:2], CEILING - position[2]), atol=1e-12)
    x, y, height = position
    point = camera_point(camera_rotation(*attitude), (x, y, CEILING - height), forward, right)
    assert np.allclose(point, turn @ (forward, right, 0.0) + shift, atol=1e-12)


@given(positions, attitudes)
def test_the_ellipse_centre_is_the_centroid_of_the_dense_outline(
    position: tuple[float, ...], attitude: tuple[float, ...]
) -> None:
    turn, shift = camera_pose(position, attitude, CEILING)
    for corner in target_corners(1.0):
        centre = ellipse_centre(tuple((turn @ corner + shift).tolist()), tuple(turn[:, 2].tolist()), 0.2)
        angle = np.linspace(0, 2 * np.pi, 4001)
        circle = corner + 0.2 * np.column_stack((np.cos(angle), np.sin(angle), 0 * angle))
        image = circle @ turn.T + shift
        x, y = (image[:, :2] / image[:, 2:]).T
        cross = x[:-1] * y[1:] - x[1:] * y[:-1]  # the shoelace formula
        area = cross.sum() / 2
        centroid = [
            ((x[:-1] + x[1:]) * cross).sum() / (6 * area),
            ((y[:-1] + y[1:]) * cross).sum() / (6 * area),
        ]
        assert np.allclose(centre, centroid, atol=1e-6)


def test_the_centre_of_a_circle_that_touches_the_plane_of_the_camera_is_nowhere() -> None:
    # The target is seen edge on from one radius away: z^2 = r^2 (1 - n_z^2).
    assert np.isnan(ellipse_centre((0.3, 0.1, 0.5), (1.0, 0.0, 0.0), 0.5)).all()


def test_the_outline_touches_its_circle_from_outside() -> None:
    outline = circle_outline((0.5, -0.5), 0.12, count=12)[:, :2] - [0.5, -0.5]
    sides = (outline + np.roll(outline, 1, axis=0)) / 2
    assert np.linalg.norm(sides, axis=1) == pytest.approx(0.12)
