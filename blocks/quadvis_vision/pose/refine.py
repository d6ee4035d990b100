"""The most probable pose by Gauss-Newton, from the picture alone or with a measured tilt, and its covariance.

The pose minimises a sum of squares, each divided by its variance: the distances in the picture between the
circles as seen and as the pose predicts them and, with a tilt, the differences of roll and pitch from it. The
unknowns are x, y, z (m), yaw, roll and pitch (rad), in this order. Frames and signs are those of
`quadvis_vision.pose.pose`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from quadvis_vision.camera.projection import camera_attitude, camera_point, camera_rotation, ellipse_centre
from quadvis_vision.camera.vectors import Vector
from quadvis_vision.pose.circles import Circle
from quadvis_vision.pose.least_squares import Triangle, factored, inverted, solved, squares, undetermined
from quadvis_vision.pose.pose import Pose

# The derivatives of a number by the unknowns, then its difference from what it should be.
Row = tuple[float, float, float, float, float, float, float]

_UNKNOWNS = 6
_CURVATURE = 21  # numbers of the triangle of 6 x 6; then six of the gradient, then the sum of squares
_STEPS = 30
_NEAR = 1e-6  # gain in the sum of squares (a thousandth of a deviation) below which a step is the last one
_DAMPING = 1e-3  # of the diagonal, used once a step has not helped; before that, steps are pure Gauss-Newton


class Unknowns(NamedTuple):
    """The place of the camera in the target frame (m), and the attitude of the craft (rad)."""

    x: float
    y: float
    z: float
    yaw: float
    roll: float
    pitch: float


class Tilt(NamedTuple):
    """A measured `roll` and `pitch` with the standard deviation `sigma` of each, all in rad."""

    roll: float
    pitch: float
    sigma: float


class Estimate(NamedTuple):
    """The `unknowns` and their `covariance` (6, 6), a triangle of `quadvis_vision.pose.least_squares`."""

    unknowns: Unknowns
    covariance: Triangle


def unknowns_of(pose: Pose) -> Unknowns:
    """Return the unknowns of a pose."""
    roll, pitch, yaw = camera_attitude(pose.rotation)
    x, y, z = pose.position
    return Unknowns(x, y, z, yaw, roll, pitch)


def pose_of(unknowns: Unknowns) -> Pose:
    """Return the pose with these unknowns."""
    turn = camera_rotation(unknowns.roll, unknowns.pitch, unknowns.yaw)
    return Pose(turn, (unknowns.x, unknowns.y, unknowns.z))


def refine(
    circles: list[Circle], radius: float, start: Unknowns, tilt: Tilt | None = None
) -> Estimate | None:
    """Return the most probable pose near some unknowns; None if the circles determine none.

    With a `radius` (m) above 0, what is seen are the centres of the ellipses that circles become. Without a
    tilt four circles are needed. With a tilt two are enough; they do not change the tilt.
    """
    place = beside = start
    found, damping = undetermined(), 0.0
    for _ in range(_STEPS):
        there = _look(circles, radius, beside, tilt)
        if there and (not found or there[-1] < found[-1]):
            place, found, damping = beside, there, damping / 10
        elif found:
            damping = max(10 * damping, _DAMPING)
        else:
            return None
        gradient = found[_CURVATURE:-1]
        factor = factored(_damped(found, damping), _UNKNOWNS)
        if not factor:
            return None
        step = solved(factor, gradient, _UNKNOWNS)
        beside = _moved(place, step)
        if not _gain(step, gradient) > _NEAR:
            place = place if damping else beside
            break
    factor = factored(found, _UNKNOWNS)
    if not (factor and math.isfinite(found[-1]) and _is_finite(place)):
        return None
    return Estimate(place, inverted(factor, _UNKNOWNS))


def _damped(found: Triangle, damping: float) -> Triangle:
    """Return the curvature with a multiple of its diagonal added."""
    curvature = found[:_CURVATURE]
    if damping:
        for index in range(_UNKNOWNS):
            curvature[index * (index + 3) // 2] *= 1 + damping
    return curvature


def _moved(place: Unknowns, step: list[float]) -> Unknowns:
    x, y, z, yaw, roll, pitch = place
    return Unknowns(
        x - step[0], y - step[1], z - step[2], yaw - step[3], roll - step[4], pitch - step[5]
    )  # fmt: skip


def _gain(step: list[float], gradient: list[float]) -> float:
    """Return by how much a step lowers the sum of squares where it is a parabola."""
    gain = 0.0
    for index in range(_UNKNOWNS):
        gain += step[index] * gradient[index]
    return gain


def _is_finite(place: Unknowns) -> bool:
    x, y, z, yaw, roll, pitch = place
    return math.isfinite(x + y + z) and math.isfinite(yaw + roll + pitch)


def _look(circles: list[Circle], radius: float, place: Unknowns, tilt: Tilt | None) -> Triangle:
    """Return half the curvature of the sum of squares, half its gradient, and the sum; [] if it has none.

    They are the triangle of the squares of [J r], the derivatives of all numbers and their differences. There
    are none if a circle is not in front of the camera.
    """
    rows: list[Row] = []
    if not _is_finite(place):
        return undetermined()
    pose = pose_of(place)
    (_, _, right), (_, _, down), (_, _, ahead) = pose.rotation
    for circle in circles:
        point = camera_point(pose.rotation, pose.position, circle.forward, circle.right)
        if not point[2] > 0:
            return undetermined()
        x, y = ellipse_centre(point, (right, down, ahead), radius)
        by_x, by_y = slopes(pose, point, place.roll, x - circle.x, y - circle.y)
        u_by_x, u_by_y, v_by_x, v_by_y = circle.weights
        rows.append(weighed(by_x, u_by_x, by_y, u_by_y))
        rows.append(weighed(by_x, v_by_x, by_y, v_by_y))
    if tilt is not None:
        weight = 1 / tilt.sigma
        rows.append((0.0, 0.0, 0.0, 0.0, weight, 0.0, (place.roll - tilt.roll) * weight))
        rows.append((0.0, 0.0, 0.0, 0.0, 0.0, weight, (place.pitch - tilt.pitch) * weight))
    return squares(rows, _UNKNOWNS + 1)


def slopes(pose: Pose, point: Vector, roll: float, off_x: float, off_y: float) -> tuple[Row, Row]:
    """Return the derivatives of a normalised point (x, y) by the unknowns, and its differences behind them.

    `point` is in camera axes. Each row is the interaction matrix of the point (Chaumette and Hutchinson,
    Visual servo control, part I, 2006), by which it moves in the picture with the camera, times the motion
    of the camera with the unknowns: its place along the target's axes, its yaw around the target's normal,
    roll around its own first axis, pitch around (0, -cos roll, sin roll). The effect of the circles' radius
    is neglected: it moves their centres too little to spoil a step.
    """
    (r11, r12, r13), (r21, r22, r23), (r31, r32, r33) = pose.rotation
    z = point[2]
    x, y = point[0] / z, point[1] / z
    xy, xx, yy = x * y, 1 + x * x, 1 + y * y
    cr, sr = math.cos(roll), math.sin(roll)
    by_x = (
        (x * r31 - r11) / z, (x * r32 - r12) / z, (x * r33 - r13) / z,
        xy * r13 - xx * r23 + y * r33, xy, xx * cr + y * sr, off_x,
    )  # fmt: skip
    by_y = (
        (y * r31 - r21) / z, (y * r32 - r22) / z, (y * r33 - r23) / z,
        yy * r13 - xy * r23 - x * r33, yy, xy * cr - x * sr, off_y,
    )  # fmt: skip
    return by_x, by_y


def weighed(a: Row, p: float, b: Row, q: float) -> Row:
    """Return p a + q b."""
    return (
        p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2], p * a[3] + q * b[3],
        p * a[4] + q * b[4], p * a[5] + q * b[5], p * a[6] + q * b[6],
    )  # fmt: skip
