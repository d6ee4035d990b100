"""The common part of the pose blocks: ports, parameters, the camera, and the outputs for a pose."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.pinhole import NUMBERS, Pinhole, pinhole
from quadvis_vision.camera.projection import SIDE, camera_attitude
from quadvis_vision.camera.two_planes import TwoPlanesCalibration
from quadvis_vision.camera.vectors import Vector
from quadvis_vision.pose.circles import Circle, image, residual, seen_circles
from quadvis_vision.pose.pose import Pose
from quadvis_vision.pose.refine import pose_of, refine, unknowns_of

if TYPE_CHECKING:
    _Base = Block
else:  # `PoseFromCircles` alone is not a block: it declares outputs, but has no output method
    _Base = object

Method = Callable[[Sequence[Vector], float], Pose | None]  # from rays to the circles and the side

PINHOLE, TWO_PLANES = range(2)
NONE, GAUSS_NEWTON = range(2)


def _numbers(path: str) -> tuple[float, ...]:
    return CameraCalibration.load(path).numbers


def _numbers_of_planes(path: str) -> tuple[float, ...]:
    return TwoPlanesCalibration.load(path).numbers


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

    optics = Derived(f"float64[{NUMBERS}]", doc="the camera as `pinhole` takes it")

    def check(self) -> None:
        """Read the calibration."""
        planes = self.rays == TWO_PLANES
        self.optics = self.read_file("calibration", _numbers_of_planes if planes else _numbers)


class PoseFromFour(PoseFromCircles):
    """A block for a method of the paper, which uses all four circles and nothing else."""

    refine = Param(
        "none",
        choices=("none", "gauss_newton"),
        doc="how the residual in the picture is minimised, if at all",
    )


def from_four(
    method: Method, centres: Any, optics: Any, side: float, radius: float, refinement: int
) -> tuple[Any, ...]:
    """Return the outputs of a block with such a method: no pose if a circle is missing or they are no square.

    The method's pose is corrected for the radius of the circles, if this is not 0, and refined as chosen.
    """
    camera = pinhole(optics)
    circles = seen_circles(centres, camera, side, np.ones(4))
    if len(circles) < 4:
        return no_pose()
    pose = method([(circle.x, circle.y, 1.0) for circle in circles], side)
    for _ in range(2 if radius > 0 else 0):
        if pose is not None:
            pose = method([_ray(pose, circle, radius) for circle in circles], side)
    if pose is not None and refinement == GAUSS_NEWTON:
        estimate = refine(circles, radius, unknowns_of(pose))
        pose = None if estimate is None else pose_of(estimate.unknowns)
    return no_pose() if pose is None else described(pose, circles, radius, camera)


def _ray(pose: Pose, circle: Circle, radius: float) -> Vector:
    """Return the ray to the middle of a circle, which its ellipse's centre misses by as much as at a pose."""
    seen_x, seen_y = image(pose, circle, radius)
    x, y = image(pose, circle, 0.0)
    return circle.x - (seen_x - x), circle.y - (seen_y - y), 1.0


def described(pose: Pose, circles: list[Circle], radius: float, camera: Pinhole) -> tuple[Any, ...]:
    """Return the outputs for a pose."""
    roll, pitch, yaw = camera_attitude(pose.rotation)
    yaw = math.pi if yaw <= -math.pi else yaw
    off = residual(pose, circles, radius, camera)
    return np.array(pose.position), yaw, np.array(pose.rotation), roll, pitch, off, True


def no_pose() -> tuple[Any, ...]:
    """Return the outputs if there is no pose."""
    missing = math.nan
    return np.full(3, missing), missing, np.full((3, 3), missing), missing, missing, missing, False
