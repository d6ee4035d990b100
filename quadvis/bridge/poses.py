"""Which blocks have a pose, and what it is with the axes of Foxglove and ROS.

Ours has x, y and the height h; its angles are 3-2-1: roll right side down, pitch nose up, yaw clockwise from
above. ROS (REP 103), and Foxglove with it, has forward, left, up, and turns counterclockwise. So with X
along x, (x, y, h) is (x, -y, h), and of the angles pitch and yaw change their signs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.output.recording import RecordedBlock, RecordedPort

POSITION, ATTITUDE = "position", "attitude"
ANGLES = ("roll", "pitch", "yaw")
WORLD = "world"  # the name of the frame in which poses are


class PoseColumns(NamedTuple):
    """Where a pose lies in the numbers of a block: x, y, h (m); roll, pitch, yaw (rad), None for 0."""

    position: tuple[int, ...]
    angles: tuple[int | None, ...]


class Posed(NamedTuple):
    """A pose with the axes of ROS: X, Y, Z (m), and a quaternion x, y, z, w."""

    place: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


def pose_columns(block: RecordedBlock) -> PoseColumns | None:
    """Return where the pose of a block lies; None if it has none.

    A pose is an output `position`, three numbers in m, with `attitude`, three in rad, or `yaw`, in rad, to
    which `roll` and `pitch` may come.
    """
    first, found = 0, dict[str, tuple[RecordedPort, int]]()
    for port in block.ports:
        found[port.name] = port, first
        first += port.size
    position = _columns(found.get(POSITION), (3,), "m")
    if position is None:
        return None
    if attitude := _columns(found.get(ATTITUDE), (3,), "rad"):
        return PoseColumns(position, attitude)
    angles = [_columns(found.get(name), (), "rad") for name in ANGLES]
    if angles[-1] is None:
        return None
    return PoseColumns(position, tuple(each[0] if each else None for each in angles))


def _columns(
    found: tuple[RecordedPort, int] | None, shape: tuple[int, ...], unit: str
) -> tuple[int, ...] | None:
    if found is None or found[0].shape != shape or found[0].unit != unit:
        return None
    return tuple(range(found[1], found[1] + math.prod(shape)))


def pose_of(values: NDArray[np.float64], columns: PoseColumns) -> Posed | None:
    """Return the pose in the numbers of a block; None if one is missing."""
    x, y, h = (float(values[column]) for column in columns.position)
    roll, pitch, yaw = (0.0 if column is None else float(values[column]) for column in columns.angles)
    if not all(map(math.isfinite, (x, y, h, roll, pitch, yaw))):
        return None
    return Posed((x, -y, h), quaternion((roll, -pitch, -yaw)))


def quaternion(angles: Sequence[float]) -> tuple[float, float, float, float]:
    """Return the quaternion x, y, z, w of 3-2-1 angles, roll, pitch and yaw (rad)."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(each / 2), math.cos(each / 2)) for each in angles)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
