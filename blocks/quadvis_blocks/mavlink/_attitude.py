"""Angles and axes of MAVLink, and ours.

MAVLink's world is north, east, down; its body forward, right, down; its angles 3-2-1: roll right side
down, pitch nose up, yaw clockwise from north, from above. Ours has the same angles and rates, and x, y and
the height h. So if x points north, positions differ in one sign: (x, y, h) is (x, y, -h). ROS (REP 103)
has east, north, up, and forward, left, up: roll is the same, pitch the other way round, yaw
counterclockwise from east.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import all_finite
from quadvis_blocks._angles import wrapped

AXES = ("quadvis", "ros")
QUADVIS, ROS = range(2)


def quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion (w, x, y, z) of 3-2-1 angles (rad)."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a / 2), math.cos(a / 2)) for a in (roll, pitch, yaw))
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def is_whole(position: Any, roll: float, pitch: float, yaw: float) -> bool:
    """Return whether no number of a pose is missing."""
    return bool(all_finite(position) and math.isfinite(roll) and math.isfinite(pitch) and math.isfinite(yaw))


def to_ned(position: Any, roll: float, pitch: float, yaw: float, axes: int, north: float) -> tuple[Any, Any]:
    """Return a position (3,) (m) in north, east, down, and angles (3,) (rad) of MAVLink.

    ``north`` is the direction of our x, of y with the axes of ROS, clockwise from north (rad).
    """
    ahead, right = position[0], position[1]
    if axes == ROS:
        ahead, right, pitch, yaw = right, ahead, -pitch, 0.5 * math.pi - yaw
    cosine, sine = math.cos(north), math.sin(north)
    moved = (cosine * ahead - sine * right, sine * ahead + cosine * right, -position[2])
    return np.array(moved), np.array((roll, pitch, wrapped(yaw + north)))


def ned_sigma(covariance: Any, axes: int, north: float) -> Any:
    """Return the standard deviations (4,) of north, east, down, yaw, of a covariance of x, y, z and yaw."""
    ahead, right, across = covariance[0, 0], covariance[1, 1], covariance[0, 1]
    if axes == ROS:
        ahead, right = right, ahead
    cosine, sine = math.cos(north), math.sin(north)
    cross = 2.0 * cosine * sine * across
    variances = (
        cosine * cosine * ahead - cross + sine * sine * right,
        sine * sine * ahead + cross + cosine * cosine * right,
        covariance[2, 2],
        covariance[3, 3],
    )
    found = np.zeros(4)
    for place in range(4):
        found[place] = (
            math.sqrt(max(variances[place], 0.0)) if variances[place] == variances[place] else math.nan
        )
    return found


def to_ned_covariance(covariance: Any, axes: int, north: float) -> Any:
    """Return a covariance (4, 4) of x, y, z or h, and yaw as that of north, east, down and yaw."""
    turn = np.diag((1.0, 1.0, -1.0, 1.0))
    turn[:2, :2] = ((math.cos(north), -math.sin(north)), (math.sin(north), math.cos(north)))
    if axes == ROS:
        turn = turn[:, [1, 0, 2, 3]] * np.array((1.0, 1.0, 1.0, -1.0))
    return turn @ covariance @ turn.T
