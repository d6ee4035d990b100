"""Which poses are sent to an autopilot, and what they are there: ports of the device and of its twin."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep
from quadvis_blocks.mavlink._attitude import AXES, is_whole, ned_sigma, to_ned


class VisionPose(Block):
    """Poses with stamps: those that are valid and news are sent, each once."""

    axes = Param(AXES[0], choices=AXES, doc="those of position and attitude; ros: east, north, up")
    north = Param(
        0.0, unit="rad", tune=True, doc="direction of x (ros: of y), clockwise from the autopilot's north"
    )
    restart = Param(
        RESTART, unit="s", above=0.0, doc="how long a restarted clock must run before its stamps count"
    )
    position = In("float64[3]", unit="m", doc="x, y, h; with the axes of ros x, y, z")
    roll = In(unit="rad", doc="right side down")
    pitch = In(unit="rad", doc="nose up; of ros nose down")
    yaw = In(unit="rad", doc="clockwise from above, from x; of ros counterclockwise")
    stamp = In(unit="s", default=math.nan, doc="instant of the picture")
    valid = In("bool", default=True, doc="whether this is a pose")
    covariance = In(
        "float64[4,4]",
        unit="m^2 m^2 m^2 m*rad " * 3 + "m*rad m*rad m*rad rad^2",
        default=np.full((4, 4), math.nan),
        doc="covariance of x, y, z and yaw; NaN if nobody knows it",
    )
    sent = Out("bool", doc="whether a pose is sent at this tick")
    place = Out("float64[3]", unit="m", nan=True, doc="north, east, down, as it is sent")
    angles = Out("float64[3]", unit="rad", nan=True, doc="roll, pitch, yaw, as they are sent")
    sigma = Out(
        "float64[4]",
        unit="m m m rad",
        nan=True,
        doc="standard deviations of north, east, down and yaw, as they are sent",
    )
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")
    moment = Work(unit="s")

    def start(self) -> None:
        """Begin without a pose."""
        begin(self.stamps)

    def output(
        self,
        position: Any,
        roll: float,
        pitch: float,
        yaw: float,
        stamp: float,
        valid: bool,
        covariance: Any,
        time: float,
    ) -> Any:
        """Return whether the pose is sent, and as what."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        if not (valid and self.verdict == NEWS and is_whole(position, roll, pitch, yaw)):
            return False, np.full(3, np.nan), np.full(3, np.nan), np.full(4, np.nan)
        place, angles = to_ned(position, roll, pitch, yaw, self.axes, self.north)
        return True, place, angles, ned_sigma(covariance, self.axes, self.north)

    def update(self, stamp: float, time: float) -> None:
        """Keep the stamp."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
