"""The position of the craft, from the position of its camera relative to the target."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param


class VehiclePosition(Block):
    """World position of the craft from the camera's position in the frame of a target on the ceiling.

    The target frame has x forward, y right and z down; its origin is the centre of the circles. So x and y
    are added to those of the target, and z is subtracted from the height of the target. NaN, for a target
    that is not seen, stays NaN.
    """

    target = Param(
        (0.0, 0.0, 3.0),
        type="float64[3]",
        unit="m",
        tune=True,
        doc="x, y, h of the target's centre in the world",
    )
    camera_position = In("float64[3]", unit="m", doc="camera in the target frame: x, y, z; NaN if not seen")
    position = Out("float64[3]", unit="m", nan=True, doc="craft in the world: x, y, h; NaN if not seen")

    example = """
        camera:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 3], [0.2, 0, 2.8]], unit: m}}
        craft: {block: estimation.vehicle_position, rate: fast, in: {camera_position: camera.y}}
    """

    def output(self, camera_position: Any) -> Any:
        """Return the position in the world."""
        target = self.target
        return np.array(
            (target[0] + camera_position[0], target[1] + camera_position[1], target[2] - camera_position[2])
        )
