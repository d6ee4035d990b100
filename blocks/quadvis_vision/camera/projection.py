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

Array = NDArray[np.float64]

# Body axes (forward, right, down) to camera axes: right in the picture is forward, down in the picture is
# left, and the optical axis points up.
CAMERA_FROM_BODY: Array = np.diag([1.0, -1.0, -1.0])
CAMERA_FROM_BODY.flags.writeable = False

SIDE = 1.0  # m, between the centres of neighbouring circles
RADIUS = 0.12  # m


def target_corners(side: float) -> Array:
    """Return the circle centres (4, 3) in target axes (m): clockwise from upper left in the picture."""
    half = side / 2
    return np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])


def rotation(attitude: ArrayLike) -> Array:
    """Return the rotation (3, 3) from body (forward, right, down) to level axes, Rz(psi) Ry(theta) Rx(phi).

    `attitude` is (phi, theta, psi) in rad: right side down, nose up and clockwise from above are positive.
    """
    phi, theta, psi = np.asarray(attitude, dtype=np.float64).tolist()
    cr, sr = math.cos(phi), math.sin(phi)
    cp, sp = math.cos(theta), math.sin(theta)
    cy, sy = math.cos(psi), math.sin(psi)
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip


def attitude_of(body_rotation: ArrayLike) -> Array:
    """Return (phi, theta, psi) in rad of a rotation (3, 3) from body to level axes; inverts `rotation`."""
    (forward, _, _), (right, _, _), (x, y, z) = np.asarray(body_rotation, dtype=np.float64).tolist()
    return np.array([math.atan2(y, z), math.atan2(-x, math.hypot(y, z)), math.atan2(right, forward)])


def camera_rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation (3, 3) from target to camera axes of a craft with an attitude in rad.

    It is CAMERA_FROM_BODY times the transpose of `rotation`, written out in plain numbers for speed.
    """
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    # 0.0 in front, since a product of matrices has no -0.0.
    rows = (
        0.0 + cy * cp, 0.0 + sy * cp, 0.0 - sp,
        0.0 - (cy * sp * sr - sy * cr), 0.0 - (sy * sp * sr + cy * cr), 0.0 - cp * sr,
        0.0 - (cy * sp * cr + sy * sr), 0.0 - (sy * sp * cr - cy * sr), 0.0 - cp * cr,
    )  # fmt: skip
    return np.array(rows).reshape(3, 3)


def camera_attitude(turn: Array) -> tuple[float, float, float]:
    """Return (phi, theta, psi) in rad from the rotation (3, 3) of the camera; inverts `camera_rotation`."""
    (forward, right, x), (_, _, y), (_, _, z) = turn.tolist()
    y, z = 0.0 - y, 0.0 - z
    return math.atan2(y, z), math.atan2(-(0.0 + x), math.hypot(y, z)), math.atan2(0.0 + right, 0.0 + forward)


def camera_pose(position: ArrayLike, attitude: ArrayLike, ceiling: float) -> tuple[Array, Array]:
    """Return (R, t) with X_c = R X_t + t for a vehicle at (x, y, h) in m with (phi, theta, psi) in rad.

    `ceiling` is the height of the target in m. R is (3, 3), t is (3,) in m.
    """
    x, y, height = np.asarray(position, dtype=np.float64).tolist()
    turn = camera_rotation(*np.asarray(attitude, dtype=np.float64).tolist())
    return turn, -turn @ np.array([x, y, ceiling - height])


def vehicle_pose(turn: ArrayLike, shift: ArrayLike, ceiling: float) -> tuple[Array, Array]:
    """Return position (x, y, h) in m and attitude (phi, theta, psi) in rad: the inverse of `camera_pose`."""
    r = np.asarray(turn, dtype=np.float64)
    x, y, z = -r.T @ np.asarray(shift, dtype=np.float64)
    return np.array([x, y, ceiling - z]), attitude_of(r.T @ CAMERA_FROM_BODY)


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


def ellipse_centres(homography: Array, centres: Array, radius: float) -> Array:
    """Return the centres (n, 2) of the ellipses that circles (n, >= 2) in m on the target become, normalised.

    The centre of an ellipse is not the image of the circle's centre: the conic's centre is w H p - r^2 H
    (h31, h32, 0)' with p = (x, y, 1) and w the depth of p.
    """
    points = np.ones((len(centres), 3))
    points[:, :2] = centres[:, :2]
    depth = points @ homography[2]
    bent = homography @ np.array((*homography[2, :2].tolist(), 0.0))
    middle = depth[:, None] * (points @ homography.T) - radius * radius * bent
    return np.asarray(middle[:, :2] / middle[:, 2:])
