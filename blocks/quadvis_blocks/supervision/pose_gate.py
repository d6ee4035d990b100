"""Which poses the inertial unit allows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks._angles import wrapped
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep
from quadvis_blocks.supervision._vision import CONTRADICTED, NONE

DEGREE = math.pi / 180.0


class PoseGate(Block):
    """A validation gate: a pose counts if the craft can have come there since the last one that counted.

    It is refused if its heading is further than ``turn`` from the last one plus what the gyro has shown
    since, or its position further than ``jump`` from the last one and what ``speed`` and ``acceleration``
    allow. The error of the gyro counts with ``drift``, so after long enough without a good pose any pose is
    in reach again. After a refusal ``confirm`` poses in a row must agree with each other as well: of random
    ones, some are in reach by chance. A picture that is turned or mirrored, or in which something else is
    taken for the target, looks good to the camera alone.

    ``plausible`` and ``reason`` hold until the next frame. Reason 7 is a refused pose, else ``trouble``.

    Source: the validation gate of Bar-Shalom and Fortmann, Tracking and data association (1988), here with
    bounds in place of deviations.
    """

    turn = Param(15.0 * DEGREE, unit="rad", above=0.0, tune=True, doc="greatest unexpected change of heading")
    drift = Param(10.0 * DEGREE, unit="rad/s", min=0.0, tune=True, doc="how fast the gyro's heading may err")
    jump = Param(0.25, unit="m", above=0.0, tune=True, doc="greatest change of position in no time")
    speed = Param(
        2.0, unit="m/s", min=0.0, tune=True, doc="greatest speed of a craft that flies as it should"
    )
    acceleration = Param(
        5.0, unit="m/s^2", min=0.0, tune=True, doc="how fast one that does not may gain more of it"
    )
    confirm = Param(3, type="int64", min=1, tune=True, doc="poses in a row that end a refusal")
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a clock that started again runs until it counts",
    )
    position = In("float64[3]", unit="m", doc="measured position; NaN if there is none")
    yaw = In(unit="rad", doc="measured heading; NaN if there is none")
    stamp = In(unit="s", doc="instant of the frame; NaN for none yet")
    valid = In("bool", default=True, doc="whether the frame gave a pose")
    yaw_rate = In(unit="rad/s", doc="rate of change of the heading, by the gyro")
    trouble = In("int64", default=NONE, doc="why frames do not count, to hand on")
    plausible = Out("bool", doc="whether the newest frame gave a pose that counts")
    reason = Out("int64", doc="7 if the newest pose was refused, else trouble")
    counted = State("float64[4]", unit="m m m rad")  # the last pose that counted
    counted_at = State(unit="s", init=math.nan)
    counted_turn = State(unit="rad")  # since then, by the gyro
    newest = State("float64[4]", unit="m m m rad")  # the last pose, whether it counted or not
    newest_at = State(unit="s", init=math.nan)
    newest_turn = State(unit="rad")
    row = State("int64")  # poses that agree, since the last refusal
    doubted = State("bool")  # whether there was one, and no row has ended it
    refused = State("bool")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of now
    moment = Work(unit="s")  # the instant that it stands for
    compared = Work("bool")  # whether there is a new pose
    row_now = Work("int64")
    refused_now = Work("bool")

    def start(self) -> None:
        """Know no pose yet."""
        begin(self.stamps)

    def output(
        self, position: Any, yaw: float, stamp: float, valid: bool, trouble: int, time: float
    ) -> tuple[bool, int]:
        """Return whether the newest pose counts, and why not."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        self.refused_now = self.refused and self.verdict != NEWS
        self.compared = self.verdict == NEWS and valid and _finite(position, yaw)
        if self.compared:
            limits = _limits(self.jump, self.speed, self.acceleration, self.turn, self.drift)
            since, last = self.moment - self.counted_at, self.moment - self.newest_at
            reached = _agrees(position, yaw, self.counted, self.counted_turn, since, limits)
            agreed = _agrees(position, yaw, self.newest, self.newest_turn, last, limits)
            self.row_now = _row(self.row, reached, agreed)
            self.refused_now = self.row_now == 0 or (self.doubted and self.row_now < self.confirm)
        return valid and not self.refused_now, CONTRADICTED if self.refused_now else trouble

    def update(self, position: Any, yaw: float, stamp: float, yaw_rate: float, time: float) -> None:
        """Keep a pose that counts, and turn with the gyro."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        self.refused = self.refused_now
        if self.compared:
            self.row = self.row_now
            self.doubted = self.refused
            self.newest[:3] = position
            self.newest[3] = yaw
            self.newest_at = self.moment
            self.newest_turn = 0.0
            if not self.refused:
                self.counted = self.newest
                self.counted_at = self.moment
                self.counted_turn = 0.0
        self.counted_turn += self.period * yaw_rate
        self.newest_turn += self.period * yaw_rate


def _finite(position: Any, yaw: float) -> bool:
    return math.isfinite(position[0] + position[1] + position[2] + yaw)


def _limits(jump: float, speed: float, acceleration: float, turn: float, drift: float) -> Any:
    return np.array((jump, speed, acceleration, turn, drift))


def _agrees(position: Any, yaw: float, before: Any, turned: float, elapsed: float, limits: Any) -> bool:
    """Return whether a pose is in reach of one before (4,); any is if NaN has elapsed."""
    away = 0.0
    for axis in range(3):
        away += (position[axis] - before[axis]) ** 2
    reach = limits[0] + (limits[1] + 0.5 * limits[2] * elapsed) * elapsed
    turn = abs(wrapped(yaw - before[3] - turned))
    return not (away > reach * reach or turn > limits[3] + limits[4] * elapsed)


def _row(row: int, reached: bool, agreed: bool) -> int:
    """Return how many poses in a row are in reach, and agree with each other."""
    if not reached:
        return 0
    return row + 1 if agreed else 1
