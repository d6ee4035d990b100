"""The paper's second method: plane-based pose."""

from __future__ import annotations

from quadvis_blocks.vision._pose_block import PoseFromFour
from quadvis_vision.pose.pose import Array, Pose, pose_from_plane


class PosePlane(PoseFromFour, numeric=False):
    """Position and attitude of the craft from the four circles by the homography of the target's plane.

    The homography from the plane to normalised image points is the first two columns of the rotation and
    the translation, up to scale; the nearest rotation is taken. The target frame has x forward, y right
    and z down from the ceiling, so z is how far the camera is below it; it looks up with picture right =
    forward. Without four circles, or if the four are no square seen from below, everything is NaN and
    `valid` false.

    Source: section 5.2, equations (32)-(35), after Sturm (2000). Its rotation equals that of
    `vision.pose_n_points`; the two differ in distance alone.
    """

    def solve(self, rays: Array) -> Pose | None:
        """Return the pose from rays (4, 3) to the circles."""
        return pose_from_plane(rays, self.side)
