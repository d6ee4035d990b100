"""The most probable pose by Gauss-Newton, from the picture alone or with a measured tilt, and its covariance.

What becomes least is the sum of the squared distances in the picture of the circles from where the pose puts
them and, with a tilt, of the squared differences of roll and pitch from it, each over its standard deviation.
The unknowns are x, y, z (m), yaw, roll and pitch (rad), in this order. Frames and signs are those of `_pose`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.camera.projection import CAMERA_FROM_BODY, attitude_of, rotation
from quadvis_vision.pose.pose import Pose, camera_points, seen_centres

Array = NDArray[np.float64]

_STEPS = 30
_NEAR = 1e-6  # of the sum of squares: a step that promises less, a thousandth of a deviation, is the last
_DAMPING = 1e-3  # of the diagonal, once a step did not help; until then it is Gauss-Newton proper
_TILT = np.array([4, 5])  # where roll and pitch are among the unknowns


class View(NamedTuple):
    """What was seen: `corners` (n, 3) of the target (m) at normalised `points` (n, 2).

    `weights` (n, 2, 2) turn differences of normalised points into standard deviations of the picture. With a
    `radius` (m) the points are the centres of the ellipses that circles on the corners become.
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
    roll, pitch, yaw = attitude_of(pose.rotation.T @ CAMERA_FROM_BODY).tolist()
    return np.array([*pose.position.tolist(), yaw, roll, pitch])


def pose_of(unknowns: Array) -> Pose:
    """Return the pose with x, y, z, yaw, roll, pitch (6,)."""
    return Pose(CAMERA_FROM_BODY @ rotation(unknowns[[4, 5, 3]]).T, unknowns[:3])


@np.errstate(all="ignore")
def refine(view: View, start: Array, tilt: Tilt | None = None) -> Estimate | None:
    """Return the most probable pose near the unknowns `start` (6,); None if the view determines none.

    Without a tilt it takes four points; with one, two determine the rest and leave the tilt as it is.
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
        step = -np.linalg.solve(curvature, place.gradient)
        if not -step @ place.gradient > _NEAR:
            if not damping:
                place = place._replace(unknowns=place.unknowns + step)
            break
        there = _look(view, place.unknowns + step, tilt)
        if there is not None and there.cost < place.cost:
            place, damping = there, damping / 10
        else:
            damping = max(10 * damping, _DAMPING)
    if not (math.isfinite(place.cost) and np.isfinite(place.unknowns).all()):
        return None
    return Estimate(place.unknowns, np.asarray(np.linalg.inv(place.curvature), np.float64))


def _look(view: View, unknowns: Array, tilt: Tilt | None) -> _Place | None:
    """Return the sum of squares and its derivatives at a pose; None if a corner is not in front of it."""
    pose = pose_of(unknowns)
    points = camera_points(pose, view.corners)
    if not (points[:, 2] > 0).all():
        return None
    residual = (view.weights @ (seen_centres(pose, points, view.radius) - view.points)[:, :, None]).ravel()
    jacobian = (view.weights @ slopes(pose, points, float(unknowns[4]))).reshape(-1, 6)
    cost, gradient, curvature = residual @ residual, jacobian.T @ residual, jacobian.T @ jacobian
    if tilt is not None:
        off = (unknowns[_TILT] - (tilt.roll, tilt.pitch)) / tilt.sigma
        cost += off @ off
        gradient[_TILT] += off / tilt.sigma
        curvature[_TILT, _TILT] += 1 / tilt.sigma**2
    return _Place(unknowns, float(cost), gradient, curvature)


def slopes(pose: Pose, points: Array, roll: float) -> Array:
    """Return the derivatives (n, 2, 6) of normalised points by the unknowns; `points` are in camera axes.

    The radius of circles is left out: it moves their centres too little to spoil a step.
    """
    places = (points / points[:, 2:]).tolist()
    moved = np.array(
        [_interaction(x, y, z) for (x, y, _), z in zip(places, points[:, 2].tolist(), strict=True)]
    )
    turn = pose.rotation
    velocities = np.zeros((6, 6))  # of the camera in its own axes by the rates of the unknowns
    velocities[:3, :3] = turn
    velocities[3:, 3] = turn[:, 2]
    velocities[3, 4] = 1.0
    velocities[4:, 5] = -math.cos(roll), math.sin(roll)
    return np.asarray(moved @ velocities)


def _interaction(x: float, y: float, z: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the interaction matrix (2, 6) of a point at depth z: its velocity by the camera's.

    Source: Chaumette and Hutchinson, Visual servo control, part I: basic approaches (2006).
    """
    return (-1 / z, 0.0, x / z, x * y, -1 - x * x, y), (0.0, -1 / z, y / z, 1 + y * y, -x * y, -x)
