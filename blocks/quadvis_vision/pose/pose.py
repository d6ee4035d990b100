"""The camera's pose from four rays to the corners of a square: the paper's two methods as pure functions.

Frames: target x forward, y right, z down from the ceiling, origin at the square's centre; corners 1..4
clockwise from the upper left of the picture at zero yaw; camera x right, y down, z forward. A point X of
the target has the camera coordinates R (X - C), C the camera's position; the upward camera is mounted
with R_camera_body = diag(1, -1, -1).

Rays are vectors from the optical centre in camera axes, of any length.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from quadvis_vision.camera.vectors import (
    Matrix,
    Vector,
    cross,
    determinant,
    dot,
    mixed,
    scaled,
    transposed,
    turned,
)
from quadvis_vision.detection.square import Homography, square_homography

_DEGENERATE = 1e-9  # a square is seen edge on if two edges span less than this part of their lengths


class Pose(NamedTuple):
    """`rotation` from target to camera axes, `position` of the camera in the target frame (m)."""

    rotation: Matrix
    position: Vector


def pose_from_n_points(rays: Sequence[Vector], side: float) -> Pose | None:
    """Return the pose by the perspective of n points, equations (24)-(31); None if the rays give no pose.

    The corners of the square are g_i = lambda_i v_i with v_i of unit length. Opposite sides are equal; from
    this Cramer's rule gives lambda_2..4 over lambda_1, (27)-(30) with corrected signs. The known side from
    corner 1 to 4 gives lambda_1, (31). The rotation is the one that best turns the target's corners to the
    g_i (Procrustes), and the camera's position is the mean of corner_i - R' g_i.
    """
    v1, v2, v3, v4 = _unit(rays[0]), _unit(rays[1]), _unit(rays[2]), _unit(rays[3])
    d234 = determinant(v2, v3, v4)
    if not abs(d234) > 0:
        return None
    second = determinant(v1, v3, v4) / d234
    third = determinant(v1, v2, v4) / d234
    fourth = determinant(v1, v2, v3) / d234
    if not (second > 0 and third > 0 and fourth > 0):
        return None
    square = 1 - 2 * dot(v1, v4) * fourth + fourth * fourth
    if not square > 0:
        return None
    first = side / math.sqrt(square)
    g1, g2 = scaled(v1, first), scaled(v2, first * second)
    g3, g4 = scaled(v3, first * third), scaled(v4, first * fourth)
    # The correlation of the points g_i with the corners (-1, 1), (1, 1), (1, -1), (-1, -1).
    along, across = mixed(g3, 1.0, g1, -1.0), mixed(g2, 1.0, g4, -1.0)
    columns = _nearest_rotation(mixed(across, 1.0, along, 1.0), mixed(across, 1.0, along, -1.0))
    if columns is None:
        return None
    a, b, c = columns
    return _pose((a, b, c), mixed(mixed(g1, 0.25, g2, 0.25), 1.0, mixed(g3, 0.25, g4, 0.25), 1.0))


def pose_from_plane(rays: Sequence[Vector], side: float) -> Pose | None:
    """Return the pose by the plane-based method, equations (32)-(35); None if the rays give no pose.

    A = K^-1 T of (34) is the homography from the target's plane to normalised points. With its first two
    columns Abar = U S V', the rotation's first two are N = U V' (35), its third their cross product; then
    mu = tr(N' Abar) / tr(Abar' Abar), w = N' A (0 0 mu)', and the camera's position is -w.
    """
    if not (rays[0][2] > 0 and rays[1][2] > 0 and rays[2][2] > 0 and rays[3][2] > 0):
        return None
    h = square_homography((_image(rays[0]), _image(rays[1]), _image(rays[2]), _image(rays[3])))
    if h is None:
        return None
    h11, h12, h13, h21, h22, h23, h31, h32, h33 = h
    return pose_from_homography((h11, h12, h13, h21, h22, h23, h31, h32, h33), side, side)


def pose_from_homography(h: Homography, width: float, height: float) -> Pose | None:
    """Return the pose by equations (34)-(35) from the homography of a rectangle (m); None if none fits.

    `h` maps the unit square (p right, q down) to normalised points, as `square_homography` returns it.
    """
    # In target coordinates p = x / width + 1/2 and q = 1/2 - y / height.
    a1 = (h[0] / width, h[3] / width, h[6] / width)
    a2 = (-h[1] / height, -h[4] / height, -h[7] / height)
    a3 = ((h[0] + h[1]) / 2 + h[2], (h[3] + h[4]) / 2 + h[5], (h[6] + h[7]) / 2 + h[8])
    columns = _nearest_rotation(a1, a2)
    if columns is None:
        return None
    a, b, c = columns
    mu = (dot(a, a1) + dot(b, a2)) / (dot(a1, a1) + dot(a2, a2))
    return _pose((a, b, c), scaled(a3, mu))


def _nearest_rotation(a: Vector, b: Vector) -> Matrix | None:
    """Return the columns of the rotation whose first two are nearest to a and b; None if a is parallel to b.

    This is U V' of the singular value decomposition of [a b], written as [a b] (M)^(-1/2) with the 2 x 2
    matrix M of their products, whose root is (M + delta I) / sqrt(tr M + 2 delta), delta = sqrt(det M) =
    |a x b|.
    """
    aa, bb, ab = dot(a, a), dot(b, b), dot(a, b)
    normal = cross(a, b)
    delta = math.sqrt(dot(normal, normal))
    if not delta > _DEGENERATE * (aa + bb):
        return None
    factor = 1 / (delta * math.sqrt(aa + bb + 2 * delta))
    first = mixed(a, (bb + delta) * factor, b, -ab * factor)
    second = mixed(b, (aa + delta) * factor, a, -ab * factor)
    return first, second, scaled(normal, 1 / delta)


def _pose(columns: Matrix, centre: Vector) -> Pose | None:
    """Return the pose from the rotation's columns and the square's centre (m); None if seen from behind."""
    position = scaled(turned(columns, centre), -1.0)
    if not (position[2] > 0 and centre[2] > 0):
        return None
    return Pose(transposed(columns), position)


def _unit(ray: Vector) -> Vector:
    length = math.sqrt(dot(ray, ray))
    return (ray[0] / length, ray[1] / length, ray[2] / length) if length > 0 else (0.0, 0.0, 0.0)


def _image(ray: Vector) -> complex:
    return complex(ray[0] / ray[2], ray[1] / ray[2])
