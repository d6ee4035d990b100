"""What stands in for poses that go to an autopilot, on the desk."""

from __future__ import annotations

from quadvis_blocks.mavlink._vision_pose import VisionPose


class NullVision(VisionPose):
    """Stands in for `mavlink.vision_position`, with the same ports: it shows what would be sent, and when.

    It runs everywhere, in simulations too: put it where a variant has the device.
    """

    example = """
        place:
          block: sources.table
          rate: slow
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 1.5], [0.3, 0, 1.5]], unit: m}}
        vision:
          block: mavlink.null_vision
          rate: slow
          in: {position: place.y, roll: 0 rad, pitch: 0 rad, yaw: 10 deg}
    """
