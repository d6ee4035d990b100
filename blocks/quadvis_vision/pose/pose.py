"""The camera's pose from four rays to the corners of a square: the paper's two methods as pure functions.

Frames: target x forward, y right, z down from the ceiling, origin at the square's centre; corners 1..4
clockwise from the upper left of the picture at zero yaw; camera x right, y down, z forward. A point X of
the target has the camera coordinates R (X - C), C the camera's position; the upward camera is mounted
with R_camera_body = diag(1, -1, -1).

Rays are vectors (4, 3) from the optical centre in camera axes, of any length, so a pinhole and a
two-planes camera serve both.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadvis_vision.detection.square import Homography, square_homography

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

_DEGENERATE = 1e-9  # a square is seen edge on if two edges span less than this part of their lengths


class Pose(NamedTuple):
    """`rotation` (3, 3) from target to camera axes, `position` (3,) of the camera in the target frame (m)."""

    rotation: Array
    position: Array


def pose_from_n_points(rays: ArrayLike, side: float) -> Pose | None:
    """Return the pose by the perspective of n points, equations (24)-(31); None if the rays give no pose.

    The corners of the square are g_i = lambda_i v_i with v_i of unit length. Opposite sides are equal; from
    this Cramer's rule gives lambda_2..4 over lambda_1, (27)-(30) with corrected signs. The known side from
    corner 1 to 4 gives lambda_1, (31). The rotation is the one that best turns the target's corners to the
    g_i (Procrustes), and the camera's position is the mean of corner_i - R' g_i.
    """
    v1, v2, v3, v4 = (_unit(ray) for ray in np.asarray(rays, dtype=np.float64).tolist())
    d234 = _determinant(v2, v3, v4)
    if not abs(d234) > 0:
        return None
    second = _determinant(v1, v3, v4) / d234
    third = _determinant(v1, v2, v4) / d234
    fourth = _determinant(v1, v2, v3) / d234
    if not (second > 0 and third > 0 and fourth > 0):
        return None
    first = side / math.sqrt(1 - 2 * _dot(v1, v4) * fourth + fourth * fourth)
    g1, g2 = _scaled(v1, first), _scaled(v2, first * second)
    g3, g4 = _scaled(v3, first * third), _scaled(v4, first * fourth)
    # The correlation of the points g_i with the corners (-1, 1), (1, 1), (1, -1), (-1, -1).
    along, across = _mixed(g3, 1, g1, -1), _mixed(g2, 1, g4, -1)
    forward, right = _mixed(across, 1, along, 1), _mixed(across, 1, along, -1)
    columns = _nearest_rotation(forward, right)
    if columns is None:
        return None
    centre = _mixed(_mixed(g1, 0.25, g2, 0.25), 1, _mixed(g3, 0.25, g4, 0.25), 1)
    return _pose(columns, centre)


def pose_from_plane(rays: ArrayLike, side: float) -> Pose | None:
    """Return the pose by the plane-based method, equations (32)-(35); None if the rays give no pose.

    A = K^-1 T of (34) is the homography from the target's plane to normalised points. With its first two
    columns Abar = U S V', the rotation's first two are N = U V' (35), its third their cross product; then
    mu = tr(N' Abar) / tr(Abar' Abar), w = N' A (0 0 mu)', and the camera's position is -w.
    """
    points = [_normalised(ray) for ray in np.asarray(rays, dtype=np.float64).tolist()]
    h = None if None in points else square_homography(points)  # type: ignore[arg-type]
    if h is None:
        return None
    return pose_from_homography(h, side, side)


def pose_from_homography(h: Homography, width: float, height: float) -> Pose | None:
    """Return the pose by equations (34)-(35) from the homography of a rectangle (m); None if none fits.

    `h` maps the unit square (p right, q down) to normalised points, as `square_homography` returns it.
    """
    # In target coordinates p = x / width + 1/2 and q = 1/2 - y / height.
    a1: Vector = (h[0] / width, h[3] / width, h[6] / width)
    a2: Vector = (-h[1] / height, -h[4] / height, -h[7] / height)
    a3: Vector = ((h[0] + h[1]) / 2 + h[2], (h[3] + h[4]) / 2 + h[5], (h[6] + h[7]) / 2 + h[8])
    columns = _nearest_rotation(a1, a2)
    if columns is None:
        return None
    mu = (_dot(columns[0], a1) + _dot(columns[1], a2)) / (_dot(a1, a1) + _dot(a2, a2))
    return _pose(columns, _scaled(a3, mu))


def camera_points(pose: Pose, points: Array) -> Array:
    """Return points (n, 3) of the target in camera axes (m)."""
    return (points - pose.position) @ pose.rotation.T


def seen_centres(pose: Pose, points: Array, radius: float) -> Array:
    """Return the normalised centres (n, 2) of the ellipses that circles on the target become.

    `points` (n, 3) are the circles' centres in camera axes (m); with a `radius` (m) of 0 their images are
    returned. A centre at infinity is NaN. The centre of an ellipse is the pole of the image of the plane's
    horizon; see also `quadvis_vision.camera.projection.ellipse_centres`.
    """
    u = v = w = 0.0
    if radius:
        u, v, w = (radius * radius * (pose.rotation[:, :2] @ pose.rotation[2, :2])).tolist()
    # In plain numbers, which on four points are faster than arrays.
    found: list[float] = []
    for x, y, z in points.tolist():
        away = (z * z - w) or math.nan
        found += ((z * x - u) / away, (z * y - v) / away)
    return np.array(found).reshape(-1, 2)


def _nearest_rotation(a: Vector, b: Vector) -> tuple[Vector, Vector, Vector] | None:
    """Return the columns of the rotation whose first two are nearest to a and b; None if a is parallel to b.

    This is U V' of the singular value decomposition of [a b], written as [a b] (M)^(-1/2) with the 2 x 2
    matrix M of their products, whose root is (M + delta I) / sqrt(tr M + 2 delta), delta = sqrt(det M) =
    |a x b|.
    """
    aa, bb, ab = _dot(a, a), _dot(b, b), _dot(a, b)
    normal = _cross(a, b)
    delta = math.sqrt(_dot(normal, normal))
    if not delta > _DEGENERATE * (aa + bb):
        return None
    factor = 1 / (delta * math.sqrt(aa + bb + 2 * delta))
    first = _mixed(a, (bb + delta) * factor, b, -ab * factor)
    second = _mixed(b, (aa + delta) * factor, a, -ab * factor)
    return first, second, _scaled(normal, 1 / delta)


def _pose(columns: tuple[Vector, Vector, Vector], centre: Vector) -> Pose | None:
    """Return the pose from the rotation's columns and the square's centre (m); None if seen from behind."""
    position = [-_dot(column, centre) for column in columns]
    if not (position[2] > 0 and centre[2] > 0):
        return None
    return Pose(np.array(columns).T, np.array(position))


def _unit(ray: list[float]) -> Vector:
    x, y, z = ray
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length) if length > 0 else (0.0, 0.0, 0.0)


def _normalised(ray: list[float]) -> complex | None:
    x, y, z = ray
    return complex(x / z, y / z) if z > 0 else None


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _determinant(a: Vector, b: Vector, c: Vector) -> float:
    return _dot(a, _cross(b, c))


def _scaled(a: Vector, factor: float) -> Vector:
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def _mixed(a: Vector, p: float, b: Vector, q: float) -> Vector:
    return (p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2])
