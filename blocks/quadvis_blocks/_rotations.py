"""Rotations as quaternions, direction cosine matrices and Euler angles.

A quaternion is (w, x, y, z); it and its matrix turn body vectors into world vectors. Roll, pitch and yaw are
3-2-1 angles: R = Rz(yaw) Ry(pitch) Rx(roll). q and -q are the same rotation.

Sources: J. B. Kuipers, Quaternions and Rotation Sequences, chapters 5 to 7; S. W. Shepperd, Quaternion from
Rotation Matrix, Journal of Guidance and Control 1 (1978).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import OutOfRange, ParameterError

POLE = 1e-12  # cosine of the pitch below which roll and yaw cannot be told apart


def dcm_of_quaternion(q: Any) -> Any:
    """Return the matrix (3, 3) of a quaternion (4,) of any norm but 0; OutOfRange if it is 0."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    square = w * w + x * x + y * y + z * z
    if square == 0.0:
        raise OutOfRange("a quaternion of norm 0 is no rotation")
    s = 2.0 / square
    found = np.empty((3, 3))
    found[0, 0], found[0, 1], found[0, 2] = (
        1.0 - s * (y * y + z * z),
        s * (x * y - w * z),
        s * (x * z + w * y),
    )
    found[1, 0], found[1, 1], found[1, 2] = (
        s * (x * y + w * z),
        1.0 - s * (x * x + z * z),
        s * (y * z - w * x),
    )
    found[2, 0], found[2, 1], found[2, 2] = (
        s * (x * z - w * y),
        s * (y * z + w * x),
        1.0 - s * (x * x + y * y),
    )
    return found


def dcm_of_euler(angles: Any) -> Any:
    """Return the matrix (3, 3) of roll, pitch and yaw (3,), rad."""
    return dcm_of_quaternion(quaternion_of_euler(angles))


def quaternion_of_euler(angles: Any) -> Any:
    """Return the quaternion (4,) of roll, pitch and yaw (3,), rad; w is not negative."""
    cr, sr = math.cos(0.5 * angles[0]), math.sin(0.5 * angles[0])
    cp, sp = math.cos(0.5 * angles[1]), math.sin(0.5 * angles[1])
    cy, sy = math.cos(0.5 * angles[2]), math.sin(0.5 * angles[2])
    q = np.empty(4)
    q[0], q[1] = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    q[2], q[3] = cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy
    return -q if q[0] < 0.0 else q


def quaternion_of_dcm(r: Any) -> Any:
    """Return the quaternion (4,) of a rotation matrix (3, 3), by its largest component; w is not negative."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    q = np.empty(4)
    if trace >= r[0, 0] and trace >= r[1, 1] and trace >= r[2, 2]:
        q[0] = 1.0 + trace
        q[1], q[2], q[3] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    else:
        i = 0
        if r[1, 1] >= r[0, 0] and r[1, 1] >= r[2, 2]:
            i = 1
        elif r[2, 2] >= r[0, 0]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        q[0] = r[k, j] - r[j, k]
        q[1 + i] = 1.0 + r[i, i] - r[j, j] - r[k, k]
        q[1 + j], q[1 + k] = r[i, j] + r[j, i], r[i, k] + r[k, i]
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if norm == 0.0:
        raise OutOfRange("this matrix is no rotation")
    return q / (-norm if q[0] < 0.0 else norm)


def euler_of_dcm(r: Any) -> Any:
    """Return roll, pitch and yaw (3,), rad, of a rotation matrix (3, 3).

    Pitch is within +-90 deg, the others within +-180 deg. At a pitch of +-90 deg roll is 0.
    """
    level = math.sqrt(r[2, 1] * r[2, 1] + r[2, 2] * r[2, 2])
    roll = math.atan2(r[2, 1], r[2, 2]) if level > POLE else 0.0
    cr, sr = math.cos(roll), math.sin(roll)
    angles = np.empty(3)
    angles[0], angles[1] = roll, math.atan2(-r[2, 0], level)
    # Of the matrix with the roll taken back: so the three agree near the poles, too.
    angles[2] = math.atan2(sr * r[0, 2] - cr * r[0, 1], cr * r[1, 1] - sr * r[1, 2])
    return angles


def quaternion_product(p: Any, q: Any) -> Any:
    """Return the quaternion (4,) of the rotation q, then p."""
    found = np.empty(4)
    found[0] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3]
    found[1] = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2]
    found[2] = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1]
    found[3] = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]
    return found


def quaternion_rate(q: Any, rates: Any) -> Any:
    """Return dq/dt (4,) of a quaternion for rates (3,) about the body axes, rad/s: q (0, rates) / 2."""
    p, s, r = 0.5 * rates[0], 0.5 * rates[1], 0.5 * rates[2]
    found = np.empty(4)
    found[0] = -q[1] * p - q[2] * s - q[3] * r
    found[1] = q[0] * p + q[2] * r - q[3] * s
    found[2] = q[0] * s - q[1] * r + q[3] * p
    found[3] = q[0] * r + q[1] * s - q[2] * p
    return found


def normalised(q: Any) -> Any:
    """Return a vector (n,) over its length; OutOfRange if that is 0."""
    return q / length(q)


def length(vector: Any) -> float:
    """Return the length of a vector (n,); OutOfRange if it is 0."""
    square = 0.0
    for index in range(vector.size):
        square += vector[index] * vector[index]
    if square == 0.0:
        raise OutOfRange("a vector of length 0 has no direction")
    return math.sqrt(square)


def turned_by(r: Any, vector: Any, back: bool) -> Any:
    """Return a matrix (3, 3) times a vector (3,); ``back``: its transpose times the vector."""
    found = np.empty(3)
    for row in range(3):
        if back:
            found[row] = r[0, row] * vector[0] + r[1, row] * vector[1] + r[2, row] * vector[2]
        else:
            found[row] = r[row, 0] * vector[0] + r[row, 1] * vector[1] + r[row, 2] * vector[2]
    return found


def refuse_no_rotation(name: str, q: Any) -> None:
    """Raise ParameterError for a quaternion whose norm is 0 or not finite."""
    square = sum(float(part) * float(part) for part in q)
    if not 1e-200 < square < 1e200:
        raise ParameterError(
            name, f"{name} must be a quaternion whose norm is not 0, got {list(map(float, q))}"
        )
