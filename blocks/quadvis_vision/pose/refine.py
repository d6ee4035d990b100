"""The most probable pose by Gauss-Newton, from the picture alone or with a measured tilt, and its covariance.

The pose minimises a sum of squares, each divided by its variance: the distances in the picture between the
circles as seen and as the pose predicts them and, with a tilt, the differences of roll and pitch from it. The
unknowns are x, y, z (m), yaw, roll and pitch (rad), in this order. Frames and signs are those of
`quadvis_vision.pose.pose`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.camera.projection import camera_attitude, camera_rotation
from quadvis_vision.pose.pose import Pose, camera_points, seen_centres

Array = NDArray[np.float64]

_STEPS = 30
_NEAR = 1e-6  # gain in the sum of squares (a thousandth of a deviation) below which a step is the last one
_DAMPING = 1e-3  # of the diagonal, used once a step has not helped; before that, steps are pure Gauss-Newton
_ROLL, _PITCH = 4, 5  # where they are among the unknowns


class View(NamedTuple):
    """The view of a target: its `corners` (n, 3) (m) were seen at the normalised `points` (n, 2).

    `weights` (n, 2, 2) convert differences of normalised points to multiples of the picture's standard
    deviation. With a `radius` (m) the points are the centres of the ellipses that circles on the corners
    become.
    """

    corners: Array
    points: Array
    weights: Array
    radius: float = 0.0


class Tilt(NamedTuple):
    """A measured `roll` and `pitch` with the standard deviation `sigma` of each, all in rad."""

    roll: float
    pitch: float
    sigma: float


class Estimate(NamedTuple):
    """The `unknowns` (6,) and their `covariance` (6, 6)."""

    unknowns: Array
    covariance: Array


class _Place(NamedTuple):
    """The sum of squares at `unknowns` (6,), half its gradient (6,) and half its curvature (6, 6)."""

    unknowns: Array
    cost: float
    gradient: Array
    curvature: Array


def unknowns_of(pose: Pose) -> Array:
    """Return x, y, z, yaw, roll, pitch (6,) of a pose."""
    roll, pitch, yaw = camera_attitude(pose.rotation)
    return np.array([*pose.position.tolist(), yaw, roll, pitch])


def pose_of(unknowns: Array) -> Pose:
    """Return the pose with x, y, z, yaw, roll, pitch (6,)."""
    yaw, roll, pitch = unknowns[3:].tolist()
    return Pose(camera_rotation(roll, pitch, yaw), unknowns[:3])


@np.errstate(all="ignore")
def refine(view: View, start: Array, tilt: Tilt | None = None) -> Estimate | None:
    """Return the most probable pose near the unknowns `start` (6,); None if the view determines none.

    Without a tilt four points are needed. With a tilt two are enough; they do not change the tilt.
    """
    try:
        return _descend(view, start, tilt)
    except np.linalg.LinAlgError:
        return None


def _descend(view: View, start: Array, tilt: Tilt | None) -> Estimate | None:
    place, damping = _look(view, start, tilt), 0.0
    if place is None:
        return None
    for _ in range(_STEPS):
        curvature = place.curvature
        if damping:
            curvature = curvature + np.diag(damping * curvature.diagonal())
        step = np.linalg.solve(curvature, place.gradient)
        unknowns = place.unknowns - step
        if not step.dot(place.gradient) > _NEAR:
            if not damping:
                place = place._replace(unknowns=unknowns)
            break
        there = _look(view, unknowns, tilt)
        if there is not None and there.cost < place.cost:
            place, damping = there, damping / 10
        else:
            damping = max(10 * damping, _DAMPING)
    if not (math.isfinite(place.cost) and all(map(math.isfinite, place.unknowns.tolist()))):
        return None
    return Estimate(place.unknowns, np.asarray(np.linalg.inv(place.curvature), np.float64))


def _look(view: View, unknowns: Array, tilt: Tilt | None) -> _Place | None:
    """Return the sum of squares and its derivatives; None if a corner is not in front of the camera."""
    pose = pose_of(unknowns)
    points = camera_points(pose, view.corners)
    if not all(depth > 0 for depth in points[:, 2].tolist()):
        return None
    residual = (view.weights @ (seen_centres(pose, points, view.radius) - view.points)[:, :, None]).ravel()
    jacobian = (view.weights @ slopes(pose, points, float(unknowns[4]))).reshape(-1, 6)
    # `dot` is `@`, with the same bits and half the overhead.
    cost, gradient, curvature = residual.dot(residual), jacobian.T.dot(residual), jacobian.T.dot(jacobian)
    if tilt is not None:
        off = (unknowns[_ROLL:] - np.array((tilt.roll, tilt.pitch))) / tilt.sigma
        cost += off.dot(off)
        gradient[_ROLL:] += off / tilt.sigma
        curvature[_ROLL, _ROLL] += 1 / tilt.sigma**2
        curvature[_PITCH, _PITCH] += 1 / tilt.sigma**2
    return _Place(unknowns, float(cost), gradient, curvature)


def slopes(pose: Pose, points: Array, roll: float) -> Array:
    """Return the derivatives (n, 2, 6) of normalised points by the unknowns; `points` are in camera axes.

    The effect of the circles' radius is neglected: it moves their centres too little to spoil a step.
    """
    moved: list[float] = []
    for x, y, z in points.tolist():
        moved += _interaction(x / z, y / z, z)
    turn = pose.rotation
    velocities = np.zeros((6, 6))  # of the camera in its own axes by the rates of the unknowns
    velocities[:3, :3] = turn
    velocities[3:, 3] = turn[:, 2]
    velocities[3, 4] = 1.0
    velocities[4, 5], velocities[5, 5] = -math.cos(roll), math.sin(roll)
    return np.asarray(np.array(moved).reshape(-1, 2, 6) @ velocities)


def _interaction(x: float, y: float, z: float) -> tuple[float, ...]:
    """Return the interaction matrix (2, 6), row by row, of a point at depth z: its velocity by the camera's.

    Source: Chaumette and Hutchinson, Visual servo control, part I: basic approaches (2006).
    """
    return (-1 / z, 0.0, x / z, x * y, -1 - x * x, y, 0.0, -1 / z, y / z, 1 + y * y, -x * y, -x)
