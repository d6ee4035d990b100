"""Position and motion of the craft, from frames that come late and in any order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work, passed
from quadvis_blocks._stamps import AHEAD, BACK, NEWS, RESTART, SIZE, judge, keep
from quadvis_blocks._stamps import begin as begin_clock
from quadvis_blocks.estimation._chain import (
    FRAMES,
    LATE,
    REFUSED,
    RESET,
    STAMP,
    TAKEN,
    TICKS,
    VALUE,
    VARIANCE,
    WIDTH,
    append,
    begin,
    filtered,
    latest,
)


class PositionFilter(Block):
    """Position, velocity and disturbance of the craft, from known accelerations and frames that come late.

    A Kalman filter. The acceleration along each axis is the known one, plus a disturbance, plus white noise.
    The disturbance wanders with the deviation ``wander`` and the correlation time ``decay``. A frame counts
    for the instant of its stamp: the filter goes back to that instant, and runs again through all later
    inputs. So frames that come late and out of order give the same result as frames in time. Without frames
    the filter continues by the accelerations alone. The last 64 ticks are kept; a frame from before them is
    refused.

    A frame counts if its stamp is news, or if its stamp goes back because the frame was overtaken on its way;
    it needs ``valid`` and finite numbers. A frame is refused in three cases:

    - Along an axis, it is further from the expected position than ``gate`` standard deviations plus
      ``tolerance``, which allows for errors of the model.
    - In x or y, it is further from the expected position than ``reach`` says that reckoning since the newest
      believed frame can be wrong: by an error of position, velocity and acceleration. A model that follows
      the frames closely has wide gates after a gap, and one wrong frame within them would set the velocity
      and the disturbance. The reach is a second, closer model: it detects, while the other one holds the
      craft. The newest believed frame may as well be the wrong one: a frame that fits without that one
      counts in its place. There is no reach by default.
    - The frame is nearer, but the strain rises above ``strain_limit``. The strain is the mean of the squared
      innovations of x and y over their variances, with a fading memory of some three frames. It is 2 when all
      is well. It rises at once when positions are not of the instants of their stamps, or contradict the
      known accelerations in another way.

    Up to the height ``contact`` the ground may carry and hold the craft, and the known accelerations do not
    include its forces. Where frames and estimates are both below ``contact``, the strain is zero, no
    disturbance of x and y is learned, and a frame that is too far off in height alone is believed and sets
    the height.

    Refused frames are tried on separate estimates. These replace the estimates of the filter when they have
    agreed with the refused frames for ``reset_after``: within the gate, without strain, and with disturbances
    within ``gate`` deviations. Frames that contradict the known accelerations never reach that; the filter
    then continues by the accelerations. ``contradicted`` is true from a refused frame to the next believed
    frame.

    The libraries do not serve here: filterpy is no longer maintained, and neither filterpy nor scipy takes
    frames out of order or can be compiled.

    Error: the covariance is right if the noise is as the parameters say. It does not include errors that last
    longer than a frame, such as those of a tilt.
    """

    acceleration = In("float64[3]", unit="m/s^2", doc="known acceleration along x, y, h, now")
    position = In("float64[3]", unit="m", doc="measured position x, y, h; NaN if there is none")
    stamp = In(unit="s", doc="instant at which the position was measured")
    valid = In("bool", default=True, doc="whether the position is good")
    measured = In(
        "float64[4,4]",
        unit="m^2 m^2 m^2 m*rad " * 3 + "m*rad m*rad m*rad rad^2",
        default=((0.0,) * 4,) * 4,
        doc="its covariance in addition to noise, as from `vision.pose_imu`; the first three variances count",
    )
    estimate = Out("float64[3]", unit="m", doc="position now: x, y, h")
    velocity = Out("float64[3]", unit="m/s", doc="rate of change of the position")
    disturbance = Out("float64[3]", unit="m/s^2", doc="acceleration in addition to the known one")
    covariance = Out(
        "float64[3,3,3]",
        unit="m^2 m^2/s m^2/s^2 m^2/s m^2/s^2 m^2/s^3 m^2/s^2 m^2/s^3 m^2/s^4 " * 3,
        doc="covariance of position, velocity and disturbance, by axis",
    )
    age = Out(unit="s", doc="time since the stamp of the newest believed frame, or since the start")
    ok = Out("bool", doc="whether a frame was believed, and the age is at most max_age")
    contradicted = Out("bool", doc="whether the newest frame that could be compared was refused")
    nis = Out(nan=True, doc="sum of squared innovations over variances of a new frame; else NaN")
    refused = Out("int64", doc="number of refused frames")

    noise = Param(
        (0.005, 0.005, 0.005), type="float64[3]", unit="m", above=0.0, tune=True,
        doc="standard deviation of a measured position",
    )  # fmt: skip
    acceleration_noise = Param(
        (0.02, 0.02, 0.02), type="float64[3]", unit="m/s^1.5", min=0.0, tune=True,
        doc="white noise of the acceleration: the velocity deviates by this times the root of the time",
    )  # fmt: skip
    wander = Param(
        (0.1, 0.1, 0.1), type="float64[3]", unit="m/s^2", above=0.0, tune=True,
        doc="standard deviation of the disturbance",
    )  # fmt: skip
    decay = Param(
        (10.0, 10.0, 10.0), type="float64[3]", unit="s", above=0.0, tune=True,
        doc="correlation time of the disturbance; it pulls a lasting disturbance a little to zero",
    )  # fmt: skip
    gate = Param(5.0, above=0.0, tune=True, doc="greatest innovation in standard deviations")
    strain_limit = Param(
        12.0,
        above=0.0,
        tune=True,
        doc="greatest strain: squared innovations of x and y over variances, mean of some frames",
    )
    contact = Param(0.2, unit="m", tune=True, doc="height up to which the ground may touch the craft")
    tolerance = Param(0.0, unit="m", min=0.0, tune=True, doc="part of an innovation that the gate ignores")
    reach = Param(
        (math.inf, 0.0, 0.0), type="float64[3]", unit="m m/s m/s^2", min=0.0, tune=True,
        doc="greatest errors of reckoning in x and y: of position, velocity and acceleration",
    )  # fmt: skip
    reset_after = Param(1.0, unit="s", above=0.0, tune=True, doc="how long refused frames must agree")
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    max_age = Param(2.0, unit="s", above=0.0, tune=True, doc="how long accelerations alone are good enough")
    initial = Param((0.0, 0.0, 0.0), type="float64[3]", unit="m", doc="position at the start")
    initial_sigma = Param(
        (1.0, 0.5),
        type="float64[2]",
        unit="m m/s",
        above=0.0,
        doc="deviation of position and velocity at the start",
    )
    initial_disturbance = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="m/s^2", min=0.0,
        doc="deviation of the disturbance at the start, such as that of an unknown mass; 0: its wander",
    )  # fmt: skip

    ticks = State(f"float64[{TICKS},4]")  # instant and acceleration, newest last
    past = State(f"float64[{TICKS},3,9]")  # estimates just before the frames of that instant
    oldest = State("int64", TICKS)  # the first tick that frames may go back to; none yet
    frames = State(f"float64[{FRAMES},{WIDTH}]")
    held = State("int64")
    stamps = State(f"float64[{SIZE}]")
    newest = State("float64", math.nan)
    refusing = State("bool")
    refusals = State("int64")
    trial = State("float64[3,9]")  # estimates by refused frames alone
    tried = State("float64[3]", math.nan)  # stamps of the first and last of these frames, and their strain
    strain = State()  # squared innovations of x and y over their variances, by fading memory
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    chains = Work("float64[3,9]")  # the estimates just before the frames of this tick
    past_now = Work(f"float64[{TICKS},3,9]")
    oldest_now = Work("int64")
    frames_now = Work(f"float64[{FRAMES},{WIDTH}]")
    held_now = Work("int64")
    newest_now = Work(unit="s")
    refusing_now = Work("bool")
    refusals_now = Work("int64")
    trial_now = Work("float64[3,9]")
    tried_now = Work("float64[3]")
    strain_now = Work()

    example = """
        place:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 1.5], [0.3, 0, 1.5]], unit: m}}
        now: {block: sources.clock, rate: fast}
        filter:
          block: estimation.position_filter
          rate: fast
          in: {acceleration: {value: [0, 0, 0], unit: m/s^2}, position: place.y, stamp: now.y}
    """

    def start(self) -> None:
        """Begin at rest at the initial position."""
        begin_clock(self.stamps)
        disturbance = np.where(self.initial_disturbance > 0.0, self.initial_disturbance, self.wander)
        begin(self.past[TICKS - 1], self.initial, self.initial_sigma, disturbance)

    def output(
        self, acceleration: Any, position: Any, stamp: float, valid: bool, measured: Any, time: float
    ) -> tuple[Any, ...]:
        """Return the estimates with the frames so far."""
        now, nis = _tick(time, acceleration), math.nan
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        self.chains = self.past[TICKS - 1]
        self.oldest_now, self.newest_now = self.oldest, self.newest
        self.refusing_now, self.refusals_now = self.refusing, self.refusals
        estimates = self.chains.copy()
        if self.oldest < TICKS:
            self.past_now = self.past
            self.frames_now = self.frames
            self.trial_now = self.trial
            self.tried_now = self.tried
            model = _model(self.acceleration_noise, self.wander, self.decay, self.contact)
            counts = _counts(self.verdict, self.moment, stamp)
            frame = _frame(position, counts, valid, measured, self.noise)
            became, self.held_now, self.oldest_now, nis, self.strain_now = filtered(
                self.chains, self.past_now, self.ticks, self.oldest, now, self.frames_now, self.held, frame,
                model, self.initial_sigma, self.gate, self.tolerance, self.reach, self.strain,
                self.strain_limit, self.trial_now, self.tried_now, self.reset_after,
            )  # fmt: skip
            estimates[:] = self.chains
            latest(estimates, self.frames_now, self.held_now, time, model)
            self.newest_now = _newer(self.newest, self.moment, became)
            self.refusals_now += 1 if became in (REFUSED, LATE) else 0
            self.refusing_now = became == REFUSED or (self.refusing and became not in (TAKEN, RESET))
        newest = self.newest_now
        age = time - (0.0 if math.isnan(newest) else newest)
        ok = not math.isnan(newest) and not passed(age, self.max_age)
        return (
            estimates[:, 0].copy(), estimates[:, 1].copy(), estimates[:, 2].copy(), _covariance(estimates),
            age, ok, self.refusing_now, nis, self.refusals_now,
        )  # fmt: skip

    def update(self, acceleration: Any, stamp: float, time: float) -> None:
        """Keep the frame, and the estimates just before the frames of this instant."""
        if self.oldest < TICKS:
            keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
            self.past = self.past_now
            self.frames = self.frames_now
            self.trial = self.trial_now
            self.tried = self.tried_now
            self.held, self.strain = self.held_now, self.strain_now
            self.newest, self.refusing, self.refusals = self.newest_now, self.refusing_now, self.refusals_now
        now = _tick(time, acceleration)
        self.oldest = append(self.ticks, self.past, self.oldest_now, now, self.chains)


def _tick(time: float, acceleration: Any) -> Any:
    return np.array((time, acceleration[0], acceleration[1], acceleration[2]))


def _model(noise: Any, wander: Any, decay: Any, contact: float) -> Any:
    return np.concatenate((noise, wander, decay, np.array([contact])))


def _counts(verdict: int, made: float, stamp: float) -> float:
    """Return the instant of a frame; NaN if it does not count. A frame ahead of the time will be refused."""
    if verdict == AHEAD:
        return stamp
    return made if verdict in (NEWS, BACK) and not math.isnan(stamp) else math.nan


def _frame(position: Any, stamp: float, valid: bool, measured: Any, noise: Any) -> Any:
    """Return a frame; its stamp is NaN if the frame cannot be used."""
    frame = np.zeros(WIDTH)
    fit = valid
    for axis in range(3):
        frame[VALUE + axis] = position[axis]
        frame[VARIANCE + axis] = measured[axis, axis] + noise[axis] * noise[axis]
        fit = fit and math.isfinite(position[axis]) and frame[VARIANCE + axis] > 0.0
    frame[STAMP] = stamp if fit and math.isfinite(frame[VARIANCE:].sum()) else math.nan
    return frame


def _newer(newest: float, stamp: float, verdict: int) -> float:
    """Return the stamp of the newest believed frame."""
    if verdict != TAKEN and verdict != RESET:
        return newest
    return stamp if math.isnan(newest) else max(newest, stamp)


def _covariance(chains: Any) -> Any:
    """Return the covariances (3, 3, 3) by axis."""
    full = np.zeros((3, 3, 3))
    for axis in range(3):
        column = 3
        for row in range(3):
            for other in range(row, 3):
                full[axis, row, other] = full[axis, other, row] = chains[axis, column]
                column += 1
    return full
