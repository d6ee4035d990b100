"""The pose with the help of the inertial unit, which knows roll and pitch better than four circles do."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks.vision._pose_block import NOTHING, Array, Bools, PoseFromCircles
from quadvis_vision.camera.projection import RADIUS
from quadvis_vision.detection.detect import INCONSISTENT, NOT_FOUND
from quadvis_vision.pose.level import level_covariance, level_pose
from quadvis_vision.pose.refine import Estimate, Tilt, View, pose_of, refine

LEVEL, MAP = range(2)
NO_TILT = 8  # a status; smaller numbers are those of the detector
MISFIT_MAX = 0.1  # sides; greatest rms error of the levelled pose: 10 deg of tilt give 0.05 at 1.6 sides
UNCERTAIN = np.full((4, 4), math.nan)


class PoseImu(PoseFromCircles, Block, numeric=False):
    """Position and heading of the craft from two circles or more, with roll and pitch from the inertial unit.

    - Mode `level` takes roll and pitch as they are. The problem for the other unknowns is linear, has one
      solution, and needs only two circles.
    - Mode `map` weighs roll and pitch against the picture: the pose is the most probable one if circles and
      angles scatter by `pixel_sigma` and `tilt_sigma`. So it is good near the target, where the picture shows
      the tilt better, and also far from it. With two circles both modes give the same pose.

    The target frame has x forward, y right and z down from the ceiling; the camera looks up with picture
    right = forward. Roll and pitch must be those at the instant of the frame: an error of one degree moves
    the craft by 1.7 % of the distance.

    `covariance` is that of a single pose, from the same sigmas. An error of the angles lasts longer than a
    frame, so successive poses share it. Without a pose all other outputs are NaN, `valid` is false, and
    `status` says why.

    Source: section 6.2 has roll and pitch from the inertial unit, but does not use them in the pose. Two or
    more points and the vertical: Kukelova, Bujnak and Pajdla, Closed-form solutions to minimal absolute pose
    problems with known vertical direction (2010); here yaw and distance are linear, as the points are level.
    """

    imu_roll = In(unit="rad", doc="measured roll at the instant of the frame, right side down is positive")
    imu_pitch = In(unit="rad", doc="measured pitch at the instant of the frame, nose up is positive")
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
    pixel_sigma = Param(0.2, unit="px", above=0.0, tune=True, doc="standard deviation of a coordinate")
    tilt_sigma = Param(
        math.radians(0.5), unit="rad", above=0.0, tune=True, doc="standard deviation of roll and of pitch"
    )

    def output(self, centres: Any, imu_roll: float, imu_pitch: float) -> tuple[Any, ...]:
        """Return the pose, its covariance and the status."""
        with np.errstate(all="ignore"):  # pixels may have any values
            rays = self._camera.rays(centres).tolist()
            flags = [z > 0 and all(map(math.isfinite, (x, y, z))) for x, y, z in rays]
            count = flags.count(True)
            if count < 2:
                return *NOTHING, UNCERTAIN, NOT_FOUND
            if not (math.isfinite(imu_roll) and math.isfinite(imu_pitch)):
                return *NOTHING, UNCERTAIN, NO_TILT
            seen = np.array(flags)
            points = np.array([
                (x / z, y / z) if flag else (math.nan, math.nan)
                for (x, y, z), flag in zip(rays, flags, strict=True)
            ])  # fmt: skip
            estimate = self._estimate(points, seen, Tilt(imu_roll, imu_pitch, self.tilt_sigma))
            if estimate is None or not np.isfinite(estimate.covariance).all():
                return *NOTHING, UNCERTAIN, INCONSISTENT
            pose = pose_of(estimate.unknowns)
            described = self._described(pose, self._seen(pose, self.radius)[seen], centres[seen])
            return *described, estimate.covariance[:4, :4], 4 - count

    def _estimate(self, points: Array, seen: Bools, tilt: Tilt) -> Estimate | None:
        """Return the unknowns and their covariance from normalised points (4, 2), NaN where not seen."""
        level = level_pose(points, tilt.roll, tilt.pitch, self.side, self.radius)
        if level is None:
            return None
        start = np.array([*level, tilt.roll, tilt.pitch])
        misfit = (self._seen(pose_of(start), self.radius) - points)[seen]
        allowed = MISFIT_MAX * self.side / level[2]  # the size of the side from straight below
        if not np.vdot(misfit, misfit) < len(misfit) * allowed * allowed:
            return None
        weights = self._camera.slopes(points[seen]) / self.pixel_sigma
        view = View(self._corners[seen], points[seen], weights, self.radius)
        if self.mode == MAP:
            return refine(view, start, tilt)
        covariance = level_covariance(view, start, tilt.sigma)
        return None if covariance is None else Estimate(start, covariance)
