"""The geometry of target and camera: poses, homographies, and the ellipses that circles become.

Axes: world x forward, y right, h up. Target: origin at the middle of the square on the ceiling, x forward, y
right, z down, so that the camera's position in target axes is (x, y, ceiling - h). Camera: x to the right of
the picture, y down the picture, z along the optical axis; it looks up, with the top of the picture to the
body's right. A point of the target appears at X_c = R X_t + t, equation (32).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadvis_vision.camera.vectors import Matrix, Vector, scaled, turned

Array = NDArray[np.float64]

SIDE = 1.0  # m, between the centres of neighbouring circles
RADIUS = 0.12  # m
CORNERS = ((-0.5, 0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5))  # forward and right, of a square of side 1


def target_corners(side: float) -> Array:
    """Return the circle centres (4, 3) in target axes (m): clockwise from upper left in the picture."""
    return np.array([[side * forward, side * right, 0.0] for forward, right in CORNERS])


def body_rotation(roll: float, pitch: float, yaw: float) -> Matrix:
    """Return Rz(yaw) Ry(pitch) Rx(roll), from body axes (forward, right, down) to level axes.

    Right side down, nose up and clockwise from above are positive; all angles are in rad.
    """
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def camera_rotation(roll: float, pitch: float, yaw: float) -> Matrix:
    """Return the rotation from target to camera axes of a craft with an attitude in rad.

    Target axes are level axes. Right in the picture is forward, down in the picture is left, and the optical
    axis points up: so this is diag(1, -1, -1) times the transpose of `body_rotation`.
    """
    (fx, rx, dx), (fy, ry, dy), (fz, rz, dz) = body_rotation(roll, pitch, yaw)
    return (fx, fy, fz), (-rx, -ry, -rz), (-dx, -dy, -dz)


def camera_attitude(turn: Matrix) -> Vector:
    """Return roll, pitch and yaw in rad from the rotation of the camera; inverts `camera_rotation`."""
    (forward, right, x), (_, _, y), (_, _, z) = turn
    level = math.sqrt(y * y + z * z)  # `math.hypot` has other bits interpreted than compiled
    return math.atan2(-y, -z), math.atan2(-x, level), math.atan2(right, forward)


def camera_point(turn: Matrix, position: Vector, forward: float, right: float) -> Vector:
    """Return the point of the target that is `forward` and `right` of its middle (m), in camera axes (m).

    `turn` is the rotation from target to camera axes, `position` that of the camera in target axes (m).
    """
    x, y, z = position
    return turned(turn, (forward - x, right - y, -z))


def camera_pose(position: ArrayLike, attitude: ArrayLike, ceiling: float) -> tuple[Array, Array]:
    """Return (R, t) with X_c = R X_t + t for a vehicle at (x, y, h) in m with (roll, pitch, yaw) in rad.

    `ceiling` is the height of the target in m. R is (3, 3), t is (3,) in m.
    """
    x, y, height = np.asarray(position, dtype=np.float64).tolist()
    turn = camera_rotation(*np.asarray(attitude, dtype=np.float64).tolist())
    return np.array(turn), np.array(scaled(turned(turn, (x, y, ceiling - height)), -1.0))


def plane_homography(turn: Array, shift: Array) -> Array:
    """Return H = [r1 r2 t] (3, 3), from target points (x, y, 1) in m to normalised image points."""
    homography = turn.copy()
    homography[:, 2] = shift
    return homography


def circle_outline(centre: Sequence[float], radius: float, count: int = 64) -> Array:
    """Return a polygon (count, 3) in m around a circle on the target; the circle touches all its sides."""
    angle = 2 * math.pi * np.arange(count) / count
    reach = radius / math.cos(math.pi / count)
    return np.column_stack(
        (centre[0] + reach * np.cos(angle), centre[1] + reach * np.sin(angle), np.zeros(count))
    )


def ellipse_centre(point: Vector, normal: Vector, radius: float) -> tuple[float, float]:
    """Return the normalised centre of the ellipse that a circle on the target becomes; NaN if at infinity.

    `point` is the circle's centre in camera axes (m), `normal` the target's normal there. The centre of an
    ellipse is not the image of the circle's centre; it is the pole of the picture's line at infinity, whose
    plane through the camera is z = 0. For a circle around X it is the image of z X + r^2 (n_z n - e_z): with
    a radius (m) of 0, that of X.
    """
    x, y, z = point
    bend = radius * radius * normal[2]
    away = z * z + bend * normal[2] - radius * radius
    if away == 0:
        return math.nan, math.nan
    return (z * x + bend * normal[0]) / away, (z * y + bend * normal[1]) / away
