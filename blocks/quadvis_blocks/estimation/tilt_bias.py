"""How far the inertial unit's idea of level is off, by what the camera sees."""

from __future__ import annotations

import math

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, note


class TiltBias(Block):
    """The slow error of the roll and pitch of an inertial unit, from frames of a camera that shows both.

    Each new frame moves the bias towards the difference of the unit's angle from the pose's, by the share
    that a first-order lag of ``time_constant`` has in the time since the frame before; the first frames count
    as in a mean. There are two ways to use it.

    The pose comes from the picture alone, as `vision.pose_n_points`: its tilt is noisy (0.7 deg at three
    sides' distance and 0.3 px), but new at each frame, and some 10 s average that out.

    The pose is `vision.pose_imu` in mode `map`, which is given the unit's angles less this bias and weighs
    them against the picture. Its tilt is then the best one already, the time constant is 0, and the two
    blocks together are a Kalman filter: ``tilt_sigma`` of the pose says how uncertain the bias is before a
    frame.

    The bias is that of the frames before this one, so a pose may depend on it.
    """

    imu_roll = In(unit="rad", doc="roll by the inertial unit at the instant of the frame")
    imu_pitch = In(unit="rad", doc="pitch by the inertial unit at the instant of the frame")
    roll = In(unit="rad", doc="roll of the pose; NaN if there is none")
    pitch = In(unit="rad", doc="pitch of the pose; NaN if there is none")
    stamp = In(unit="s", doc="instant of the frame; NaN for none yet")
    valid = In("bool", default=True, doc="whether the pose is good")
    roll_bias = Out(unit="rad", doc="error of the unit's roll")
    pitch_bias = Out(unit="rad", doc="error of the unit's pitch")

    time_constant = Param(10.0, unit="s", min=0.0, tune=True, doc="of the average; 0 takes the newest frame")
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a clock that started again runs until it counts",
    )
    limit = Param(0.1, unit="rad", above=0.0, tune=True, doc="greatest bias; one beyond it is a wrong pose")

    by_roll = State(unit="rad")
    by_pitch = State(unit="rad")
    frames = State("int64")
    measured = State(unit="s")  # the last frame that counted
    stamps = State(f"float64[{SIZE}]")

    def start(self) -> None:
        """Know no frame yet."""
        begin(self.stamps)

    def output(self) -> tuple[float, float]:
        """Return the bias by the frames so far."""
        return self.by_roll, self.by_pitch

    def update(
        self, imu_roll: float, imu_pitch: float, roll: float, pitch: float, stamp: float, valid: bool,
        time: float,
    ) -> None:  # fmt: skip
        """Take a new frame into account."""
        verdict, made = note(self.stamps, stamp, time, self.restart)
        off_roll, off_pitch = imu_roll - roll, imu_pitch - pitch
        if not valid or math.isnan(stamp) or verdict != NEWS:
            return
        if not (abs(off_roll) <= self.limit and abs(off_pitch) <= self.limit):
            return
        self.frames += 1
        elapsed = made - self.measured if self.frames > 1 else 0.0
        share = 1.0 if self.time_constant == 0.0 else -math.expm1(-elapsed / self.time_constant)
        share = max(share, 1.0 / self.frames)
        self.by_roll += share * (off_roll - self.by_roll)
        self.by_pitch += share * (off_pitch - self.by_pitch)
        self.measured = made
