"""The paper's first method: the perspective of n points."""

from __future__ import annotations

from quadvis_blocks.vision._pose_block import PoseFromFour
from quadvis_vision.pose.pose import Array, Pose, pose_from_n_points


class PoseNPoints(PoseFromFour, numeric=False):
    """Position and attitude of the craft from the four circles by the perspective of n points.

    The distances of the circles along their rays follow from the fact that opposite sides of a square are
    equal, and from the length of the side between circles 1 and 4. The target frame has x forward, y
    right and z down from the ceiling, so z is how far the camera is below it; it looks up with picture
    right = forward. Without four circles, or if the four are no square seen from below, everything is NaN
    and `valid` false.

    Source: section 5.1, equations (24)-(31), with the signs of (27) put right and the rotation by
    Procrustes. Its rotation equals that of `vision.pose_plane`; the two differ in distance alone.
    """

    def solve(self, rays: Array) -> Pose | None:
        """Return the pose from rays (4, 3) to the circles."""
        return pose_from_n_points(rays, self.side)
