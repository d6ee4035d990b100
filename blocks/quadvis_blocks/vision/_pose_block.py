"""The common part of the pose blocks: ports, parameters, and the way from pixels to rays and back."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block import Block, In, Out, Param
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.lens import by_point
from quadvis_vision.camera.projection import SIDE, camera_attitude, target_corners
from quadvis_vision.camera.two_planes import TwoPlanesCalibration
from quadvis_vision.pose.pose import Pose, camera_points, seen_centres
from quadvis_vision.pose.refine import View, pose_of, refine, unknowns_of

if TYPE_CHECKING:
    _Base = Block
else:  # `PoseFromCircles` alone is not a block: it declares outputs, but has no output method
    _Base = object

Array = NDArray[np.float64]
Bools = NDArray[np.bool]

PINHOLE, TWO_PLANES = range(2)
NONE, GAUSS_NEWTON = range(2)
NOTHING = (np.full(3, math.nan), math.nan, np.full((3, 3), math.nan), math.nan, math.nan, math.nan, False)


class PinholeRays:
    """Rays of a pinhole camera with a lens."""

    def __init__(self, path: str) -> None:
        self.camera = CameraCalibration.load(path)

    def rays(self, pixels: Array) -> Array:
        """Return the vectors (n, 3) in camera axes along which pixels (n, 2) look."""
        if self.camera.bends:
            return np.column_stack((self.camera.normalise(pixels), np.ones(len(pixels))))
        # The same in plain numbers, which on four pixels are faster than arrays.
        fx, skew, cx, fy, cy = self.camera.intrinsics
        heights = [(v - cy) / fy for v in pixels[:, 1].tolist()]
        return np.array(
            [((u - cx - skew * y) / fx, y, 1.0) for u, y in zip(pixels[:, 0].tolist(), heights, strict=True)]
        )

    def pixels(self, points: Array) -> Array:
        """Return the pixels (n, 2) of normalised points (n, 2)."""
        return self.camera.to_pixels(points)

    def slopes(self, points: Array) -> Array:
        """Return the derivatives (n, 2, 2) of pixels by normalised points (n, 2), the lens included."""
        matrix, lens = self.camera.matrix[:2, :2], self.camera.distortion
        return matrix @ by_point(points, lens) if self.camera.bends else _alike(matrix, points)


class TwoPlanesRays:
    """Rays of a camera that was calibrated on two planes."""

    def __init__(self, path: str) -> None:
        self.planes = TwoPlanesCalibration.load(path)
        self.matrix = self.planes.pinhole[0]

    def rays(self, pixels: Array) -> Array:
        """Return the unit vectors (n, 3) in camera axes along which pixels (n, 2) look, eq. (4)."""
        return self.planes.rays(pixels)

    def pixels(self, points: Array) -> Array:
        """Return the pixels (n, 2) of normalised points (n, 2)."""
        return np.asarray(points @ self.matrix[:2, :2].T + self.matrix[:2, 2])

    def slopes(self, points: Array) -> Array:
        """Return the derivatives (n, 2, 2) of pixels by normalised points (n, 2)."""
        return _alike(self.matrix[:2, :2], points)


def _alike(matrix: Array, points: Array) -> Array:
    """Return the matrix (2, 2) once for each point."""
    return np.broadcast_to(matrix, (len(points), 2, 2))


class PoseFromCircles(_Base):
    """Ports and parameters of a block that computes the pose of the craft from the circles of the target."""

    centres = In("float64[4,2]", unit="px", doc="u, v of circles 1 to 4; a row with NaN is missing")
    position = Out(
        "float64[3]", unit="m", nan=True, doc="x forward, y right of the target's middle, z below it"
    )
    yaw = Out(unit="rad", nan=True, doc="heading relative to the target, clockwise from above, in (-pi, pi]")
    rotation = Out("float64[3,3]", nan=True, doc="from target axes to camera axes")
    roll = Out(unit="rad", nan=True, doc="right side down is positive")
    pitch = Out(unit="rad", nan=True, doc="nose up is positive")
    residual = Out(unit="px", nan=True, doc="rms distance of the circles from their places by the pose")
    valid = Out("bool", doc="whether there is a pose")

    calibration = Param(type="file", doc="camera calibration file (YAML)")
    rays = Param("pinhole", choices=("pinhole", "two_planes"), doc="kind of the calibration in the file")
    side = Param(SIDE, unit="m", above=0.0, doc="distance between the centres of neighbouring circles")
    radius = Param(
        0.0, unit="m", min=0.0, doc="of the circles, to correct for perspective; 0: circles are points"
    )

    def check(self) -> None:
        """Read the calibration."""
        self._load()

    def _load(self) -> PinholeRays | TwoPlanesRays:
        if self.rays == TWO_PLANES:
            return self.read_file("calibration", TwoPlanesRays)
        return self.read_file("calibration", PinholeRays)

    def open(self) -> None:
        """Read the calibration."""
        self._camera = self._load()
        self._corners = target_corners(self.side)

    def _seen(self, pose: Pose, radius: float) -> Array:
        """Return the normalised points (4, 2) at which circles of a radius (m) are seen from a pose."""
        return seen_centres(pose, camera_points(pose, self._corners), radius)

    def _described(self, pose: Pose, seen: Array, centres: Array) -> tuple[Any, ...]:
        """Return the outputs for a pose; `seen` (n, 2) are the normalised points of its circles."""
        roll, pitch, yaw = camera_attitude(pose.rotation)
        errors = self._camera.pixels(seen) - centres
        residual = math.sqrt(np.vdot(errors, errors) / len(errors))
        yaw = math.pi if yaw <= -math.pi else yaw
        return pose.position, yaw, pose.rotation, roll, pitch, residual, True


class PoseFromFour(PoseFromCircles, Block, numeric=False):
    """A block for a method of the paper, which uses all four circles and nothing else: `solve`."""

    refine = Param(
        "none",
        choices=("none", "gauss_newton"),
        doc="how the residual in the picture is minimised, if at all",
    )

    def solve(self, rays: Array) -> Pose | None:
        """Return the pose from rays (4, 3) to the circles; None if they meet no square in front."""
        raise NotImplementedError

    def output(self, centres: Any) -> tuple[Any, ...]:
        """Return the pose; NaN and false if a circle is missing or the four are no square seen from below."""
        with np.errstate(all="ignore"):  # pixels may have any values
            rays = self._camera.rays(centres)
            pose = self.solve(rays) if np.isfinite(rays).all() else None
            if pose is not None and (self.radius or self.refine == GAUSS_NEWTON):
                pose = self._improved(pose, rays[:, :2] / rays[:, 2:])
            return NOTHING if pose is None else self._described(pose, self._seen(pose, self.radius), centres)

    def _improved(self, start: Pose, points: Array) -> Pose | None:
        """Return the pose from normalised points (4, 2), corrected for the radius and refined as chosen."""
        pose: Pose | None = start
        for _ in range(2 if self.radius else 0):
            if pose is None:
                return None
            shift = self._seen(pose, self.radius) - self._seen(pose, 0.0)
            pose = self.solve(np.column_stack((points - shift, np.ones(4))))
        if pose is None or self.refine == NONE:
            return pose
        view = View(self._corners, points, self._camera.slopes(points), self.radius)
        estimate = refine(view, unknowns_of(pose))
        return None if estimate is None else pose_of(estimate.unknowns)
