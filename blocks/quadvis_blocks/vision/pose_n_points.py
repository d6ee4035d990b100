"""The paper's first method: the perspective of n points."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block
from quadvis_blocks.vision._pose_block import PoseFromFour, from_four
from quadvis_vision.pose.pose import pose_from_n_points


class PoseNPoints(PoseFromFour, Block):
    """Position and attitude of the craft from the four circles by the perspective of n points.

    The distances of the circles along their rays follow from two facts: opposite sides of a square are equal,
    and the side between circles 1 and 4 has a known length. The target frame has x forward, y right and z
    down from the ceiling, so z is the distance of the camera below the ceiling. The camera looks up with
    picture right = forward. Without four circles, or if the four are no square seen from below, all other
    outputs are NaN and `valid` is false.

    Source: section 5.1, equations (24)-(31), with corrected signs in (27) and the rotation by Procrustes. The
    rotation equals that of `vision.pose_plane`; the two poses differ only in distance.
    """

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
          block: vision.pose_n_points
          rate: slow
          with: {calibration: "quadvis:calib/camera.yaml", side: 1 m}
          in: {centres: camera.centres}
    """

    def output(self, centres: Any) -> tuple[Any, ...]:
        """Return the pose; NaN and false if a circle is missing or the four are no square seen from below."""
        return from_four(pose_from_n_points, centres, self.optics, self.side, self.radius, self.refine)
