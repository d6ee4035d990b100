"""The error of the inertial unit's level, from the camera's pictures."""

from __future__ import annotations

import math

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, note


class TiltBias(Block):
    """The slow error of the roll and pitch of an inertial unit, from camera poses that measure both angles.

    Each new frame moves the bias towards the difference of the unit's angle from the pose's angle. The step
    is that of a first-order lag with ``time_constant`` over the time since the frame before; the first frames
    count as in a mean. There are two ways to use the block:

    - The pose comes from the picture alone, as from `vision.pose_n_points`. Its tilt is noisy (0.7 deg at a
      distance of three sides and 0.3 px), but the noise is new at each frame, and averages out in some 10 s.
    - The pose comes from `vision.pose_imu` in mode `map`, whose inputs are the unit's angles minus this bias.
      `vision.pose_imu` weighs these angles against the picture, so its tilt is already the best estimate, and
      ``time_constant`` is 0. The two blocks together are a Kalman filter: ``tilt_sigma`` of the pose is the
      uncertainty of the bias before a frame.

    The output is the bias from the frames before this tick, so a pose may depend on it.
    """

    imu_roll = In(unit="rad", doc="roll by the inertial unit at the instant of the frame")
    imu_pitch = In(unit="rad", doc="pitch by the inertial unit at the instant of the frame")
    roll = In(unit="rad", doc="roll of the pose; NaN if there is none")
    pitch = In(unit="rad", doc="pitch of the pose; NaN if there is none")
    stamp = In(unit="s", doc="instant of the frame; NaN before the first")
    valid = In("bool", default=True, doc="whether the pose is good")
    roll_bias = Out(unit="rad", doc="error of the unit's roll")
    pitch_bias = Out(unit="rad", doc="error of the unit's pitch")

    time_constant = Param(
        10.0, unit="s", min=0.0, tune=True, shown=True, doc="of the average; 0: only the newest frame"
    )
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    limit = Param(0.1, unit="rad", above=0.0, tune=True, doc="greatest bias; more means a wrong pose")

    by_roll = State(unit="rad")
    by_pitch = State(unit="rad")
    frames = State("int64")
    measured = State(unit="s")  # instant of the last frame that counted
    stamps = State(f"float64[{SIZE}]")

    example = """
        now: {block: sources.clock, rate: fast}
        bias:
          block: estimation.tilt_bias
          rate: fast
          in: {imu_roll: 1 deg, imu_pitch: 0 deg, roll: 0.2 deg, pitch: 0.1 deg, stamp: now.y}
    """

    def start(self) -> None:
        """Begin without a frame."""
        begin(self.stamps)

    def output(self) -> tuple[float, float]:
        """Return the bias from the frames so far."""
        return self.by_roll, self.by_pitch

    def update(
        self, imu_roll: float, imu_pitch: float, roll: float, pitch: float, stamp: float, valid: bool,
        time: float,
    ) -> None:  # fmt: skip
        """Correct the bias by a new frame."""
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
