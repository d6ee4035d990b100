"""The pose of the craft, from that of its camera."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._angles import carrier, is_zero, rotation, turned


class CraftPose(Block):
    """Position and attitude of the craft, from position and attitude of a camera that sits askew on it.

    The pose blocks take the camera for the craft: in the middle of the craft, and looking straight up. The
    camera may sit ``offset`` away from the middle, along the axes of the craft, and be turned against these
    axes by ``angles``. Put this block behind a pose block to allow for both. Without offset and angles, the
    outputs are the inputs to the bit. NaN, for a target that is not seen, stays NaN.

    Roll and pitch decide where the middle of the craft is; without them the camera counts as level.

    Source: rigid bodies. With the camera's rotation C = R M, that of the mount M and that of the craft
    R = C M^T, each Rz(yaw) Ry(pitch) Rx(roll), the craft is at p - R o.
    """

    offset = Param(
        (0.0, 0.0, 0.0),
        type="float64[3]",
        unit="m",
        tune=True,
        doc="of the camera from the middle of the craft: forward, right, up",
    )
    angles = Param(
        (0.0, 0.0, 0.0),
        type="float64[3]",
        unit="rad",
        tune=True,
        doc="of the camera against the craft: roll, pitch, yaw",
    )
    camera_position = In("float64[3]", unit="m", doc="camera in the target frame: x, y, z down")
    camera_roll = In(unit="rad", default=0.0, doc="roll of the camera, right side down is positive")
    camera_pitch = In(unit="rad", default=0.0, doc="pitch of the camera, front up is positive")
    camera_yaw = In(unit="rad", doc="heading of the camera, clockwise from above")
    position = Out(
        "float64[3]", unit="m", nan=True, doc="middle of the craft in the target frame: x, y, z down"
    )
    roll = Out(unit="rad", nan=True, doc="roll of the craft")
    pitch = Out(unit="rad", nan=True, doc="pitch of the craft")
    yaw = Out(unit="rad", nan=True, doc="heading of the craft")

    example = """
        turn: {block: sources.ramp, rate: fast, with: {slope: 90 deg/s}}
        craft:
          block: estimation.craft_pose
          rate: fast
          with: {offset: {value: [0.1, 0, 0.05], unit: m}}
          in: {camera_position: {value: [0, 0, 3], unit: m}, camera_yaw: turn.y}
    """

    def output(
        self, camera_position: Any, camera_roll: float, camera_pitch: float, camera_yaw: float
    ) -> tuple[Any, float, float, float]:
        """Return position and attitude of the craft."""
        craft = carrier(np.array((camera_roll, camera_pitch, camera_yaw)), self.angles)
        position, offset = camera_position.copy(), self.offset
        if not is_zero(offset):
            turn = rotation(float(craft[0]), float(craft[1]), float(craft[2]))
            position -= turned(turn, np.array((offset[0], offset[1], -offset[2])))
        return position, float(craft[0]), float(craft[1]), float(craft[2])
