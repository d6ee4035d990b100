"""The mathematics of poses, which is in plain numbers, for the arrays of the tests."""

import numpy as np

from quadvis_vision.pose.circles import Circle
from quadvis_vision.pose.pose import Pose


def arrays_of(pose):
    """A pose of arrays."""
    return None if pose is None else Pose(np.array(pose.rotation), np.array(pose.position))


def pose_by(method, rays, side):
    """The pose of arrays by a method of the paper from rays (4, 3)."""
    return arrays_of(method([tuple(ray) for ray in np.asarray(rays).tolist()], side))


def circles_at(points, corners, weights=None):
    """The circles that are seen at normalised points (n, 2), except for rows with NaN; corners (n, >= 2)."""
    weights = np.tile(np.eye(2), (len(points), 1, 1)) if weights is None else weights
    return [
        Circle(*point, *point, *corner[:2], tuple(weight))
        for point, corner, weight in zip(
            np.asarray(points).tolist(),
            np.asarray(corners).tolist(),
            weights.reshape(-1, 4).tolist(),
            strict=True,
        )
        if not np.isnan(point).any()
    ]


def full(triangle, count):
    """The symmetric array (count, count) of a triangle; None if it is empty."""
    if not triangle:
        return None
    found = np.zeros((count, count))
    rows, columns = np.tril_indices(count)
    found[rows, columns] = found[columns, rows] = triangle[: len(rows)]
    return found
