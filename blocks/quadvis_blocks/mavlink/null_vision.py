"""What stands in for poses that go to an autopilot, on the desk."""

from __future__ import annotations

from quadvis_blocks.mavlink._vision_pose import VisionPose


class NullVision(VisionPose):
    """Stands in for `mavlink.vision_position`, with the same ports: it shows what would be sent, and when.

    It runs everywhere, in simulations too: put it where a variant has the device.
    """
