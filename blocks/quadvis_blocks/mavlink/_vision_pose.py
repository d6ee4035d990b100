"""Which poses are sent to an autopilot, and what they are there: ports of the device and of its twin."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep
from quadvis_blocks.mavlink._attitude import AXES, ned_sigma, to_ned


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
    attitude = In("float64[3]", unit="rad", doc="roll, pitch, yaw")
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
        self, position: Any, attitude: Any, stamp: float, valid: bool, covariance: Any, time: float
    ) -> Any:
        """Return whether the pose is sent, and as what."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        whole = np.isfinite(position).all() and np.isfinite(attitude).all()
        sent = bool(valid and whole and self.verdict == NEWS)
        if not sent:
            return False, np.full(3, np.nan), np.full(3, np.nan), np.full(4, np.nan)
        place, angles = to_ned(position, attitude, self.axes, self.north)
        return True, place, angles, ned_sigma(covariance, self.axes, self.north)

    def update(self, stamp: float, time: float) -> None:
        """Keep the stamp."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
