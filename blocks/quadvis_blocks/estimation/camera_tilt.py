"""Roll and pitch of the camera, from those of the craft."""

from __future__ import annotations

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._angles import askew


class CameraTilt(Block):
    """Roll and pitch of a camera that is turned against the craft by ``angles``, from those of the craft.

    Put this block between the inertial unit and `vision.pose_imu`, which takes both for those of the camera.
    The heading of the craft does not matter, and a camera that is turned about its optical axis alone swaps
    part of roll and pitch. Without angles, the outputs are the inputs to the bit.

    Source: rigid bodies, R M, with R of the craft and M of the mount as Rz(yaw) Ry(pitch) Rx(roll).
    """

    angles = Param(
        (0.0, 0.0, 0.0),
        type="float64[3]",
        unit="rad",
        tune=True,
        doc="of the camera against the craft: roll, pitch, yaw",
    )
    roll = In(unit="rad", doc="roll of the craft, right side down is positive")
    pitch = In(unit="rad", doc="pitch of the craft, nose up is positive")
    camera_roll = Out(unit="rad", nan=True, doc="roll of the camera")
    camera_pitch = Out(unit="rad", nan=True, doc="pitch of the camera")

    example = """
        roll: {block: sources.sine, rate: fast, with: {amplitude: 10 deg, frequency: 1 Hz}}
        tilt:
          block: estimation.camera_tilt
          rate: fast
          with: {angles: {value: [0, 0, 90], unit: deg}}
          in: {roll: roll.y, pitch: 2 deg}
    """

    def output(self, roll: float, pitch: float) -> tuple[float, float]:
        """Return roll and pitch of the camera."""
        camera = askew(np.array((roll, pitch, 0.0)), self.angles)
        return float(camera[0]), float(camera[1])
