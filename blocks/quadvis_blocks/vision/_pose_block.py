"""What the two pose blocks share: ports, parameters and the way from pixels to rays and back."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block import Block, In, Out, Param, ParameterError
from quadvis.errors import QuadvisError
from quadvis_blocks.vision._calibration import CameraCalibration
from quadvis_blocks.vision._pose import Pose, corner_points
from quadvis_blocks.vision._projection import CAMERA_FROM_BODY, SIDE, attitude_of
from quadvis_blocks.vision._two_planes import TwoPlanesCalibration

Array = NDArray[np.float64]

PINHOLE, TWO_PLANES = range(2)
NOTHING = (np.full(3, math.nan), math.nan, np.full((3, 3), math.nan), math.nan, math.nan, math.nan, False)


class PinholeRays:
    """Rays of a pinhole camera with a lens."""

    def __init__(self, path: str) -> None:
        self.camera = CameraCalibration.load(path)

    def rays(self, pixels: Array) -> Array:
        """Return vectors (n, 3) in camera axes toward what pixels (n, 2) see."""
        xy = self.camera.normalise(pixels)
        return np.column_stack((xy, np.ones(len(xy))))

    def project(self, points: Array) -> Array:
        """Return the pixels (n, 2) of points (n, 3) in camera axes."""
        return self.camera.project(points)


class TwoPlanesRays:
    """Rays of a camera that was calibrated on two planes."""

    def __init__(self, path: str) -> None:
        self.planes = TwoPlanesCalibration.load(path)

    def rays(self, pixels: Array) -> Array:
        """Return unit vectors (n, 3) in camera axes toward what pixels (n, 2) see, eq. (4)."""
        return self.planes.rays(pixels)

    def project(self, points: Array) -> Array:
        """Return the pixels (n, 2) of points (n, 3) in camera axes."""
        pixels = points @ self.planes.pinhole[0].T
        return np.asarray(pixels[:, :2] / pixels[:, 2:])


class PoseFromCircles(Block, numeric=False):
    """Position and attitude of the craft from the four circles; a method says how. All four must be there."""

    centres = In("float64[4,2]", unit="px", doc="u, v of circles 1 to 4; a row with NaN is missing")
    position = Out(
        "float64[3]", unit="m", nan=True, doc="x forward, y right of the target's middle, z below it"
    )
    yaw = Out(unit="rad", nan=True, doc="heading against the target, clockwise from above, in (-pi, pi]")
    rotation = Out("float64[3,3]", nan=True, doc="from target axes to camera axes")
    roll = Out(unit="rad", nan=True, doc="right side down is positive")
    pitch = Out(unit="rad", nan=True, doc="nose up is positive")
    residual = Out(unit="px", nan=True, doc="rms distance of the circles from where the pose puts them")
    valid = Out("bool", doc="whether there is a pose")

    calibration = Param(type="file", doc="camera calibration file (YAML)")
    rays = Param("pinhole", choices=("pinhole", "two_planes"), doc="what kind of calibration the file holds")
    side = Param(SIDE, unit="m", above=0.0, doc="distance between the centres of neighbouring circles")

    def check(self) -> None:
        """Read the calibration."""
        self._load()

    def _load(self) -> PinholeRays | TwoPlanesRays:
        try:
            return (
                TwoPlanesRays(self.calibration) if self.rays == TWO_PLANES else PinholeRays(self.calibration)
            )
        except QuadvisError as error:
            raise ParameterError("calibration", f"calibration is not usable: {error}") from None

    def open(self) -> None:
        """Read the calibration."""
        self._camera = self._load()

    def solve(self, rays: Array) -> Pose | None:
        """Return the pose from rays (4, 3) to the circles; None if they meet no square in front."""
        raise NotImplementedError

    def output(self, centres: Any) -> tuple[Any, ...]:
        """Return the pose; NaN and false if a circle is missing or the four are no square seen from below."""
        rays = self._camera.rays(centres)
        pose = self.solve(rays) if np.isfinite(rays).all() else None
        if pose is None:
            return NOTHING
        roll, pitch, yaw = attitude_of(pose.rotation.T @ CAMERA_FROM_BODY).tolist()
        error = self._camera.project(corner_points(pose, self.side)) - centres
        residual = math.sqrt(np.vdot(error, error) / 4)
        yaw = math.pi if yaw <= -math.pi else yaw
        return pose.position, yaw, pose.rotation, roll, pitch, residual, True
