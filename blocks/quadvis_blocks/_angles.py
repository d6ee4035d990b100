"""Angles on the circle, and the rotations that roll, pitch and yaw stand for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis_vision.camera.projection import body_rotation

TURN = 2.0 * math.pi


def wrapped(angle: float) -> float:
    """Return the same direction in (-pi, pi]; an angle in that interval is returned bit for bit."""
    turned = angle - TURN * math.ceil((angle - math.pi) / TURN)
    return math.pi if turned > math.pi else turned  # one rounding step beyond pi is pi


def rotation(roll: float, pitch: float, yaw: float) -> Any:
    """Return `body_rotation` as an array (3, 3), from body axes (forward, right, down) to level axes."""
    return np.array(body_rotation(roll, pitch, yaw))


def turned(turn: Any, vector: Any) -> Any:
    """Return a rotation (3, 3) times a vector (3,), without the library that a matrix product would call."""
    return turn[:, 0] * vector[0] + turn[:, 1] * vector[1] + turn[:, 2] * vector[2]


def askew(attitude: Any, mount: Any) -> Any:
    """Return roll, pitch and yaw (3,) of a device that sits on a craft turned by `mount`, itself such angles.

    The mount (0, 0, 0) gives the attitude to the bit.
    """
    if is_zero(mount):
        return attitude.copy()
    device = rotation(float(mount[0]), float(mount[1]), float(mount[2]))
    return _angles_of(_product(rotation(float(attitude[0]), float(attitude[1]), float(attitude[2])), device))


def carrier(attitude: Any, mount: Any) -> Any:
    """Return roll, pitch and yaw (3,) of the craft that carries a device with this attitude; inverts `askew`.

    The mount (0, 0, 0) gives the attitude to the bit.
    """
    if is_zero(mount):
        return attitude.copy()
    device = rotation(float(mount[0]), float(mount[1]), float(mount[2]))
    return _angles_of(
        _product(rotation(float(attitude[0]), float(attitude[1]), float(attitude[2])), device.T)
    )


def is_zero(vector: Any) -> bool:
    """Return whether all three numbers are 0."""
    return bool(vector[0] == 0.0 and vector[1] == 0.0 and vector[2] == 0.0)


def _product(first: Any, second: Any) -> Any:
    """Return the product of two rotations (3, 3)."""
    found = np.empty((3, 3))
    for column in range(3):
        found[:, column] = turned(first, second[:, column])
    return found


def _angles_of(turn: Any) -> Any:
    """Return roll, pitch and yaw (3,) of a rotation (3, 3); inverts `rotation`."""
    across, up = float(turn[2, 1]), float(turn[2, 2])
    level = math.sqrt(across * across + up * up)  # `math.hypot` has other bits interpreted than compiled
    return np.array(
        (
            math.atan2(across, up),
            math.atan2(-float(turn[2, 0]), level),
            math.atan2(float(turn[1, 0]), float(turn[0, 0])),
        )
    )
