"""How a camera sits on a craft: its angles from tilts, and its place from a turn of the craft."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.calibrate.memory_noise import fit
from quadvis_vision.camera.projection import camera_rotation

Floats = NDArray[np.float64]

ROUNDS = 20
STEP = 1e-6  # rad, of the difference quotients
ENOUGH = 1e-9  # rad, of a correction
LEAST = 20  # frames


@dataclass(frozen=True)
class Uncertain:
    """Values (p,) that were estimated, and their covariance (p, p)."""

    values: Floats
    covariance: Floats

    @property
    def deviations(self) -> Floats:
        """Standard deviations (p,)."""
        found: Floats = np.sqrt(np.diag(self.covariance))
        return found


def find_angles(times: Floats, camera: Floats, craft: Floats, yaw: float | None = None) -> Uncertain:
    """Return roll, pitch and yaw (rad) of a camera against its craft from the tilts of both.

    `camera` and `craft` are roll and pitch (N, 2) in rad at `times` (N,) in s. The vertical is one direction
    in the axes of both, d = M d', with d' in those of the camera. Its mean gives roll and pitch, its motion
    yaw. With a given `yaw` only roll and pitch are unknown.

    Source: Wahba, A least squares estimate of satellite attitude (1965), for the first guess.
    """
    seen, level = _verticals(camera), _verticals(craft)
    angles = np.array((0.0, 0.0, _yaw(seen, level) if yaw is None else yaw))
    unknown = [0, 1, 2] if yaw is None else [0, 1]
    for _ in range(ROUNDS):
        off = (level - seen @ _rotation(angles).T)[:, :2]
        slopes = [seen @ _slope(angles, index).T for index in unknown]
        change, covariance = fit(times, np.stack(slopes, axis=2)[:, :2], off)
        angles[unknown] += change
        if np.abs(change).max() < max(ENOUGH, 1e-3 * np.sqrt(np.diag(covariance)).min()):
            break
    angles = (angles + np.pi) % (2 * np.pi) - np.pi
    return Uncertain(angles[unknown], covariance)


def find_offset(times: Floats, position: Floats, attitude: Floats, mount: Uncertain, up: float) -> Uncertain:
    """Return how far (m) forward and right of the middle of a craft its camera sits, from a turn about it.

    `position` (N, 2) is x and y of the camera in m, `attitude` (N, 3) its roll, pitch and yaw in rad; `mount`
    are the angles, and the camera is `up` m above the middle. In a turn the camera moves on a circle. An
    error of the yaw of the mount turns the offset.
    """
    turns = np.array([_rotation(row) for row in attitude]) @ _rotation(mount.values).T
    circle = position + up * turns[:, :2, 2]  # the axis of the craft points down
    still = np.broadcast_to(np.eye(2), (len(times), 2, 2))
    values, covariance = fit(times, np.concatenate((still, turns[:, :2, :2]), axis=2), circle)
    forward, right = values[2:]
    aside = np.array((-right, forward))
    return Uncertain(values[2:], covariance[2:, 2:] + np.outer(aside, aside) * mount.covariance[2, 2])


def swept(yaw: Floats) -> float:
    """Return the angle (rad) between the outermost headings (N,)."""
    return float(np.ptp(np.unwrap(yaw)))


def _rotation(angles: Floats) -> Floats:
    """Return Rz(yaw) Ry(pitch) Rx(roll)."""
    roll, pitch, yaw = angles
    found: Floats = np.array(camera_rotation(float(roll), float(pitch), float(yaw))).T * (1.0, -1.0, -1.0)
    return found


def _slope(angles: Floats, index: int) -> Floats:
    """Return the derivative of the rotation by one of its angles."""
    step = STEP * np.eye(3)[index]
    return (_rotation(angles + step) - _rotation(angles - step)) / (2 * STEP)


def _verticals(tilts: Floats) -> Floats:
    """Return the downward direction (N, 3) in the axes of a body with roll and pitch (N, 2)."""
    roll, pitch = tilts.T
    return np.column_stack((-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)))


def _yaw(seen: Floats, level: Floats) -> float:
    """Return the angle by which the motion of one vertical is turned against that of the other."""
    one, other = (each[:, :2] - each[:, :2].mean(axis=0) for each in (seen, level))
    across = np.sum(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    return float(np.arctan2(across, np.sum(one * other)))
