"""The pose with the help of the inertial unit, which knows roll and pitch better than four circles do."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks.vision._pose_block import PoseFromCircles, described, no_pose
from quadvis_vision.camera.pinhole import pinhole
from quadvis_vision.camera.projection import RADIUS
from quadvis_vision.detection.detect import INCONSISTENT, NOT_FOUND
from quadvis_vision.pose.circles import Circle, seen_circles
from quadvis_vision.pose.consistency import is_a_square
from quadvis_vision.pose.least_squares import Triangle
from quadvis_vision.pose.level import level_covariance, level_pose
from quadvis_vision.pose.refine import Estimate, Tilt, pose_of, refine

LEVEL, MAP = range(2)
NO_TILT = 8  # a status; smaller numbers are those of the detector
SIGMA_MAX = 1e3  # px: from here on a circle counts nothing
_NUMBERS = 10  # of the triangle of 4 x 4


class PoseImu(PoseFromCircles, Block):
    """Position and heading of the craft from two circles or more, with roll and pitch from the inertial unit.

    - Mode `level` takes roll and pitch as they are. The problem for the other unknowns is linear, has one
      solution, and needs only two circles.
    - Mode `map` weighs roll and pitch against the picture: the pose is the most probable one if circles and
      angles scatter by `pixel_sigma` and `tilt_sigma`. So it is good near the target, where the picture shows
      the tilt better, and also far from it. With two circles both modes give the same pose.

    The target frame has x forward, y right and z down from the ceiling; the camera looks up with picture
    right = forward. Roll and pitch must be those at the instant of the frame: an error of one degree moves
    the craft by 1.7 % of the distance.

    `sigma` takes the place of `pixel_sigma` circle by circle, as the detector measures it in each picture; it
    says nothing of errors of the calibration, which all pictures share.

    There is no pose if three or four circles are not where a square can show them with about this tilt: a
    picture may be torn, its parts from different instants. With two circles every picture has a pose.

    `covariance` is that of a single pose, from the same sigmas. An error of the angles lasts longer than a
    frame, so successive poses share it. Without a pose all other outputs are NaN, `valid` is false, and
    `status` says why.

    Source: section 6.2 has roll and pitch from the inertial unit, but does not use them in the pose. Two or
    more points and the vertical: Kukelova, Bujnak and Pajdla, Closed-form solutions to minimal absolute pose
    problems with known vertical direction (2010); here yaw and distance are linear, as the points are level.
    """

    imu_roll = In(unit="rad", doc="measured roll at the instant of the frame, right side down is positive")
    imu_pitch = In(unit="rad", doc="measured pitch at the instant of the frame, nose up is positive")
    sigma = In(
        "float64[4]",
        unit="px",
        default=(math.nan,) * 4,
        doc="standard deviations of the coordinates of circles 1 to 4; NaN: pixel_sigma",
    )
    covariance = Out(
        "float64[4,4]",
        unit="m^2 m^2 m^2 m*rad " * 3 + "m*rad m*rad m*rad rad^2",
        nan=True,
        doc="covariance of x, y, z and yaw",
    )
    status = Out(
        "int64", doc="0, 1, 2: from four, three, two circles; 3: fewer; 4: no square of circles; 8: no tilt"
    )

    radius = Param(
        RADIUS, unit="m", min=0.0, doc="of the circles, to correct for perspective; 0: circles are points"
    )
    mode = Param("map", choices=("level", "map"), doc="take the angles as they are, or weigh them")
    pixel_sigma = Param(
        0.2, unit="px", above=0.0, tune=True, doc="standard deviation of a coordinate that has no other"
    )
    tilt_sigma = Param(
        math.radians(0.5), unit="rad", above=0.0, tune=True, doc="standard deviation of roll and of pitch"
    )

    example = """
        place:
          block: sources.table
          rate: slow
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 1.5], [0.3, 0, 1.5]], unit: m}}
        camera:
          block: vision.geometric_camera
          rate: slow
          with: {calibration: "quadvis:calib/camera.yaml", ceiling: 4.5 m, side: 1 m, noise: 0.3 px}
          in: {position: place.y, attitude: {value: [0, 0, 0], unit: rad}}
        pose:
          block: vision.pose_imu
          rate: slow
          with: {calibration: "quadvis:calib/camera.yaml", side: 1 m}
          in: {centres: camera.centres, imu_roll: 0 rad, imu_pitch: 0 rad}
    """

    def output(self, centres: Any, imu_roll: float, imu_pitch: float, sigma: Any) -> tuple[Any, ...]:
        """Return the pose, its covariance and the status."""
        camera = pinhole(self.optics)
        circles = seen_circles(centres, camera, self.side, _sigmas(sigma, self.pixel_sigma))
        covariance = np.full((4, 4), math.nan)
        if len(circles) < 2:
            return *no_pose(), covariance, NOT_FOUND
        if not (math.isfinite(imu_roll) and math.isfinite(imu_pitch)):
            return *no_pose(), covariance, NO_TILT
        tilt = Tilt(imu_roll, imu_pitch, self.tilt_sigma)
        estimate = _estimate(circles, tilt, self.side, self.radius, self.mode)
        if estimate is None or not _is_whole(estimate.covariance):
            return *no_pose(), covariance, INCONSISTENT
        _write(estimate.covariance, covariance)
        pose = pose_of(estimate.unknowns)
        return *described(pose, circles, self.radius, camera), covariance, 4 - len(circles)


def _estimate(circles: list[Circle], tilt: Tilt, side: float, radius: float, mode: int) -> Estimate | None:
    """Return the unknowns and their covariance."""
    level = level_pose(circles, tilt.roll, tilt.pitch, radius)
    if level is None:
        return None
    if not is_a_square(circles, side, radius, level):
        return None
    if mode == MAP:
        return refine(circles, radius, level, tilt)
    return Estimate(level, level_covariance(circles, level, tilt.sigma))


def _sigmas(given: Any, otherwise: float) -> Any:
    """Return standard deviations (4,) in px, where none are given the other one."""
    return np.where(given > 0, np.minimum(given, SIGMA_MAX), otherwise)


def _is_whole(triangle: Triangle) -> bool:
    """Return whether there is a covariance, and x, y, z and yaw have a finite one."""
    for index in range(min(len(triangle), _NUMBERS)):
        if not math.isfinite(triangle[index]):
            return False
    return len(triangle) >= _NUMBERS


def _write(triangle: Triangle, covariance: Any) -> None:
    """Write the covariance of x, y, z and yaw."""
    place = 0
    for row in range(4):
        for column in range(row + 1):
            covariance[row, column] = covariance[column, row] = triangle[place]
            place += 1
