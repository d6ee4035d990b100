"""Poses from vision for the estimator of an autopilot."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import NewsOutput
from quadvis_blocks._stamps import NEWS, judge
from quadvis_blocks.mavlink._attitude import is_whole, to_ned, to_ned_covariance
from quadvis_blocks.mavlink._station import Station
from quadvis_blocks.mavlink._vision_pose import VisionPose

LATEST = 1e12  # s
ORDER = (0, 1, 2, 5)  # where x, y, z and yaw are among x, y, z, roll, pitch, yaw


class VisionPosition(Station, VisionPose, NewsOutput):
    """Poses from vision for the estimator of an autopilot, VISION_POSITION_ESTIMATE.

    Each pose that is valid and news is sent once, in north, east, down, and 3-2-1 angles; ours is x, y,
    height with the same angles. Repeating an old pose, or sending one at an end, would deceive the
    estimator, so nothing is sent then: it knows what to do without vision. The time of a message is the
    stamp, in run time; an autopilot that is not told otherwise takes the instant at which it comes. So set
    the delay from picture to autopilot there: EKF2_EV_DELAY of PX4, VISO_DELAY_MS of ArduPilot.

    See https://mavlink.io/en/messages/common.html#VISION_POSITION_ESTIMATE.
    """

    example = """
        place:
          block: sources.table
          rate: slow
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 1.5], [0.3, 0, 1.5]], unit: m}}
        vision:
          block: mavlink.vision_position
          rate: slow
          with: {port: udp:127.0.0.1:14550}
          in: {position: place.y, roll: 0 rad, pitch: 0 rad, yaw: 10 deg}
    """

    def frame(
        self,
        position: Any,
        roll: float,
        pitch: float,
        yaw: float,
        stamp: float,
        valid: bool,
        covariance: Any,
        time: float,
    ) -> bytes:
        """Return the message of a pose; none if it is not sent."""
        verdict, moment = judge(self.stamps, stamp, time, self.restart)
        if not (valid and verdict == NEWS and is_whole(position, roll, pitch, yaw)):
            return b""
        place, angles = to_ned(position, roll, pitch, yaw, self.axes, self.north)
        return self.framed(
            "VISION_POSITION_ESTIMATE",
            usec=round(1e6 * min(max(moment, 0.0), LATEST)),
            **dict(zip(("x", "y", "z"), map(float, place), strict=True)),
            **dict(zip(("roll", "pitch", "yaw"), map(float, angles), strict=True)),
            covariance=_triangle(to_ned_covariance(covariance, self.axes, self.north)),
        )


def _triangle(covariance: Any) -> tuple[float, ...]:
    """Return the upper triangle, row by row, of the covariance (6, 6) of place and angles.

    The first number is NaN if nobody knows it, and roll and pitch, which vision takes from elsewhere, are 0.
    """
    if not np.isfinite(covariance).all():
        return (math.nan, *(0.0,) * 20)
    full = np.zeros((6, 6))
    full[np.ix_(ORDER, ORDER)] = covariance
    return tuple(map(float, full[np.triu_indices(6)]))
