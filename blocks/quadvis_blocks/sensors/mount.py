"""Where a device on the craft is, and how it is turned."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._angles import askew, rotation, turned


class Mount(Block):
    """Position and attitude of a device on the craft, such as its camera, from those of the craft.

    The device sits ``offset`` away from the middle of the craft, along the axes of the craft, and is turned
    against these axes by ``angles``. Put the block between the craft and a simulated camera to fly a camera
    that is not where the pose blocks believe it is. Without offset and angles, the outputs are the inputs to
    the bit.

    Source: rigid bodies, p + R o and R M, with R and M as Rz(yaw) Ry(pitch) Rx(roll).
    """

    offset = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="m", tune=True, doc="of the device: forward, right, up"
    )
    angles = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="rad", tune=True,
        doc="of the device against the craft: roll, pitch, yaw",
    )  # fmt: skip
    position = In("float64[3]", unit="m", doc="position of the craft: x forward, y right, h up")
    attitude = In("float64[3]", unit="rad", doc="roll, pitch, yaw of the craft")
    place = Out("float64[3]", unit="m", doc="position of the device")
    turned = Out("float64[3]", unit="rad", doc="roll, pitch, yaw of the device")

    example = """
        turn:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 0], [0, 0, 90]], unit: deg}}
        camera:
          block: sensors.mount
          rate: fast
          with: {offset: {value: [0.1, 0, 0.05], unit: m}}
          in: {position: {value: [0, 0, 1.5], unit: m}, attitude: turn.y}
    """

    def output(self, position: Any, attitude: Any) -> tuple[Any, Any]:
        """Return position and attitude of the device."""
        place, offset = position.copy(), self.offset
        if offset[0] != 0.0 or offset[1] != 0.0 or offset[2] != 0.0:
            turn = rotation(float(attitude[0]), float(attitude[1]), float(attitude[2]))
            forward, right, down = turned(turn, np.array((offset[0], offset[1], -offset[2])))
            place += np.array((forward, right, -down))
        return place, askew(attitude, self.angles)
