"""The gate for poses that contradict the inertial unit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks._angles import wrapped
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep
from quadvis_blocks.supervision._vision import CONTRADICTED, NONE, REARMING

DEGREE = math.pi / 180.0


class PoseGate(Block):
    """A validation gate: a pose counts if the craft can have reached it since the last pose that counted.

    Let t be the time since the last pose that counted. A pose is refused in two cases:

    - Its heading differs from the last heading plus the rotation by the gyro by more than ``turn + drift t``.
    - Its position is further from the last position than ``jump + speed t + acceleration t^2 / 2``.

    So after a long enough time without a good pose, every pose is in reach again. After a refusal, or after
    ``confirm`` frames in a row without a pose, ``confirm`` poses in a row must be in reach and agree with
    each other, because some random poses are in reach by chance. The gate catches errors that look good to
    the camera alone: a picture that is turned or mirrored, noise, or another thing taken for the target.

    ``plausible`` and ``reason`` hold until the next frame. Reason 7 is a refused pose, 3 a pose that only
    waits for others to agree with it, else ``trouble``.

    Source: the validation gate of Bar-Shalom and Fortmann, Tracking and data association (1988), here with
    bounds in place of deviations.
    """

    turn = Param(15.0 * DEGREE, unit="rad", above=0.0, tune=True, doc="greatest unexpected change of heading")
    drift = Param(10.0 * DEGREE, unit="rad/s", min=0.0, tune=True, doc="greatest drift of the gyro's heading")
    jump = Param(0.25, unit="m", above=0.0, tune=True, doc="greatest change of position in zero time")
    speed = Param(2.0, unit="m/s", min=0.0, tune=True, doc="greatest speed of a craft in normal flight")
    acceleration = Param(
        5.0, unit="m/s^2", min=0.0, tune=True, doc="greatest acceleration of a craft that exceeds it"
    )
    confirm = Param(
        3,
        type="int64",
        min=1,
        tune=True,
        doc="frames in a row that begin a doubt; poses that end it",
    )
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    position = In("float64[3]", unit="m", doc="measured position; NaN if there is none")
    yaw = In(unit="rad", doc="measured heading; NaN if there is none")
    stamp = In(unit="s", doc="instant of the frame; NaN before the first")
    valid = In("bool", default=True, doc="whether the frame gave a pose")
    yaw_rate = In(unit="rad/s", doc="rate of change of the heading, by the gyro")
    trouble = In("int64", default=NONE, doc="why frames do not count, to be passed on")
    plausible = Out("bool", doc="whether the newest frame gave a pose that counts")
    reason = Out("int64", doc="7 if the newest pose was refused, 3 if it waits for others, else trouble")
    counted = State("float64[4]", unit="m m m rad")  # the last pose that counted
    counted_at = State(unit="s", init=math.nan)
    counted_turn = State(unit="rad")  # rotation since then, by the gyro
    newest = State("float64[4]", unit="m m m rad")  # the last pose, whether it counted or not
    newest_at = State(unit="s", init=math.nan)
    newest_turn = State(unit="rad")
    row = State("int64")  # poses that agree, since the last refusal
    empty = State("int64")  # frames in a row without a pose
    doubted = State("bool")  # whether there was a refusal that no row of poses has ended
    proving = State("bool")  # whether there were frames without a pose, after which no row of poses has come
    refused = State("bool")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    compared = Work("bool")  # whether there is a new pose
    row_now = Work("int64")
    refused_now = Work("bool")
    doubted_now = Work("bool")
    proving_now = Work("bool")

    example = """
        now: {block: sources.clock, rate: slow}
        place:
          block: sources.table
          rate: slow
          with:
            times: {value: [0, 0.5, 0.7], unit: s}
            values: {value: [[0, 0, 1.5], [0, 3, 1.5], [0, 0, 1.5]], unit: m}
            interpolation: hold
        gate:
          block: supervision.pose_gate
          rate: slow
          in: {position: place.y, yaw: 0 rad, stamp: now.y, yaw_rate: 0 rad/s}
    """

    def start(self) -> None:
        """Begin without a pose."""
        begin(self.stamps)

    def output(
        self, position: Any, yaw: float, stamp: float, valid: bool, trouble: int, time: float
    ) -> tuple[bool, int]:
        """Return whether the newest pose counts, and why not."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        self.refused_now = self.refused and self.verdict != NEWS
        self.doubted_now = self.doubted
        self.compared = self.verdict == NEWS and valid and _finite(position, yaw)
        if self.compared:
            limits = _limits(self.jump, self.speed, self.acceleration, self.turn, self.drift)
            since, last = self.moment - self.counted_at, self.moment - self.newest_at
            reached = _agrees(position, yaw, self.counted, self.counted_turn, since, limits)
            agreed = _agrees(position, yaw, self.newest, self.newest_turn, last, limits)
            begun = self.empty >= self.confirm
            self.proving_now = self.proving or begun
            self.row_now = _row(0 if begun else self.row, reached, agreed)
            doubtful = self.doubted or self.proving_now
            self.refused_now = self.row_now == 0 or (doubtful and self.row_now < self.confirm)
            self.doubted_now = self.refused_now and (self.doubted or self.row_now == 0)
        if self.refused_now:
            return False, CONTRADICTED if self.doubted_now else REARMING
        return valid, trouble

    def update(self, position: Any, yaw: float, stamp: float, yaw_rate: float, time: float) -> None:
        """Keep the newest pose, and the pose that counts; add the rotation by the gyro."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        self.refused = self.refused_now
        if self.verdict == NEWS:
            self.empty = 0 if self.compared else self.empty + 1
        if self.compared:
            self.row = self.row_now
            self.doubted = self.doubted_now
            self.proving = self.proving_now and self.refused
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
    """Return whether a pose is in reach of an earlier pose (4,); true if ``elapsed`` (s) is NaN."""
    away = 0.0
    for axis in range(3):
        away += (position[axis] - before[axis]) ** 2
    reach = limits[0] + (limits[1] + 0.5 * limits[2] * elapsed) * elapsed
    turn = abs(wrapped(yaw - before[3] - turned))
    return not (away > reach * reach or turn > limits[3] + limits[4] * elapsed)


def _row(row: int, reached: bool, agreed: bool) -> int:
    """Return the number of poses in a row that are in reach and agree with each other."""
    if not reached:
        return 0
    return row + 1 if agreed else 1
