"""The paper's first method: the perspective of n points."""

from __future__ import annotations

from quadvis_blocks.vision._pose_block import PoseFromFour
from quadvis_vision.pose.pose import Array, Pose, pose_from_n_points


class PoseNPoints(PoseFromFour, numeric=False):
    """Position and attitude of the craft from the four circles by the perspective of n points.

    The distances of the circles along their rays follow from two facts: opposite sides of a square are equal,
    and the side between circles 1 and 4 has a known length. The target frame has x forward, y right and z
    down from the ceiling, so z is the distance of the camera below the ceiling. The camera looks up with
    picture right = forward. Without four circles, or if the four are no square seen from below, all other
    outputs are NaN and `valid` is false.

    Source: section 5.1, equations (24)-(31), with corrected signs in (27) and the rotation by Procrustes. The
    rotation equals that of `vision.pose_plane`; the two poses differ only in distance.
    """

    def solve(self, rays: Array) -> Pose | None:
        """Return the pose from rays (4, 3) to the circles."""
        return pose_from_n_points(rays, self.side)
