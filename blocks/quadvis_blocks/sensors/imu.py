"""The inertial measurement unit (IMU) on board."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import INSTANT, Block, In, Out, Param, Random, State, fill_normal, random_signs
from quadvis_blocks._angles import askew, rotation, turned
from quadvis_blocks._delay import check_delay

DEGREE = math.pi / 180.0
GIVEN, RANDOM = range(2)
CAPACITY = 128


class Imu(Block):
    """Roll, pitch and angular rates as an inertial unit gives them: true value, bias, drift, white noise.

    The unit sits on the craft turned by ``misalignment``, multiplies what it measures by ``scale``, and gives
    it ``delay`` later, with straight lines between ticks; the first sample stands for all before it. The
    other errors add to that. By default the unit has none of these three errors.

    White noise is drawn anew at each tick of the block. The drift of each angle and rate is a first-order
    Gauss-Markov process, exact at the block's rate and stationary from the first sample. With ``bias_sign:
    random`` each bias is a size, and gets a random sign of its own at the start of a run. The noise, the
    drift of the rates and the signs have separate random streams, so turning one on does not change the
    others. The unit does not measure yaw: the camera does.

    Source: section 6.2 (an IMU gives roll and pitch at a higher rate than the camera). The default errors are
    those of a typical unit at 100 Hz.
    """

    angle_noise = Param(
        0.1 * DEGREE, unit="rad", min=0.0, tune=True, doc="white noise of roll and pitch, one sigma"
    )
    drift = Param(0.2 * DEGREE, unit="rad", min=0.0, tune=True, doc="slow drift of roll and pitch, one sigma")
    drift_time = Param(20.0, unit="s", above=0.0, tune=True, doc="correlation time of the drifts")
    rate_noise = Param(
        0.5 * DEGREE, unit="rad/s", min=0.0, tune=True, doc="white noise of each rate, one sigma"
    )
    rate_drift = Param(0.0, unit="rad/s", min=0.0, tune=True, doc="slow drift of each rate, one sigma")
    angle_bias = Param(
        (0.0, 0.0), type="float64[2]", unit="rad", tune=True, doc="constant error of roll and pitch"
    )
    rate_bias = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="rad/s", tune=True, doc="constant error of each rate"
    )
    scale = Param(1.0, above=0.0, tune=True, doc="measured over true, of angles and rates")
    misalignment = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="rad", tune=True,
        doc="roll, pitch and yaw of the unit against the craft",
    )  # fmt: skip
    delay = Param(0.0, unit="s", min=0.0, doc="time from a measurement until the unit gives it")
    bias_sign = Param(
        "given", choices=("given", "random"), doc="random: each bias gets a random sign at the start"
    )
    attitude = In("float64[3]", unit="rad", doc="true roll, pitch, yaw")
    rates = In("float64[3]", unit="rad/s", doc="true rates about roll, pitch and yaw axis")
    roll = Out(unit="rad", doc="measured roll angle")
    pitch = Out(unit="rad", doc="measured pitch angle")
    gyro = Out("float64[3]", unit="rad/s", doc="measured rates about roll, pitch and yaw axis")
    stamp = Out(unit="s", doc="instant of the measurement")
    drawn = State("float64[7]")  # drawn at each tick: roll, pitch, three rates, drift of roll and pitch
    wander = State("float64[2]")  # the drifts; all in standard deviations
    rate_drawn = State("float64[3]")
    rate_wander = State("float64[3]")
    signs = State("float64[5]")  # of the biases of roll, pitch and three rates
    past = State(f"float64[{CAPACITY},5]")  # angles and rates at the ticks before this one, newest first
    kept = State("int64")
    stream = Random()
    rate_stream = Random()
    sign_stream = Random()

    def start(self) -> None:
        """Draw the signs of the biases and the first errors."""
        fill_normal(self.stream, self.drawn)
        self.wander = self.drawn[5:]
        fill_normal(self.rate_stream, self.rate_wander)
        self.signs[:] = 1.0
        if self.bias_sign == RANDOM:
            random_signs(self.sign_stream, self.signs)

    def check(self) -> None:
        """Refuse a delay that holds more samples than there is room for."""
        check_delay(self.delay, CAPACITY, self.period)

    def output(self, attitude: Any, rates: Any, time: float) -> tuple[float, float, Any, float]:
        """Return the measured angles and rates, and the instant of the measurement."""
        drawn, wander, bias, signs = self.drawn, self.wander, self.angle_bias, self.signs
        true = _sensed(attitude, rates, self.misalignment, self.scale)
        if self.delay > 0.0:
            true = _earlier(true, self.past, self.kept, self.delay, self.period)
        roll = true[0] + signs[0] * bias[0] + self.drift * wander[0] + self.angle_noise * drawn[0]
        pitch = true[1] + signs[1] * bias[1] + self.drift * wander[1] + self.angle_noise * drawn[1]
        slow = signs[2:] * self.rate_bias + self.rate_drift * self.rate_wander
        return roll, pitch, true[2:] + slow + self.rate_noise * drawn[2:5], time - self.delay

    def update(self, attitude: Any, rates: Any) -> None:
        """Keep this sample for later, and draw the next errors."""
        if self.delay > 0.0:
            self.past[1:] = self.past[:-1].copy()
            self.past[0] = _sensed(attitude, rates, self.misalignment, self.scale)
            self.kept = min(self.kept + 1, CAPACITY)
        keep = math.exp(-self.period / self.drift_time)
        step = math.sqrt(1.0 - keep * keep)
        fill_normal(self.stream, self.drawn)
        self.wander = keep * self.wander + step * self.drawn[5:]
        if self.rate_drift > 0.0:
            fill_normal(self.rate_stream, self.rate_drawn)
            self.rate_wander = keep * self.rate_wander + step * self.rate_drawn


def _sensed(attitude: Any, rates: Any, misalignment: Any, scale: float) -> Any:
    """Return roll, pitch and three rates (5,) about the axes of the unit, times its scale."""
    sensed = np.zeros(5)
    sensed[:2] = askew(attitude, misalignment)[:2]
    sensed[2:] = rates
    if misalignment[0] != 0.0 or misalignment[1] != 0.0 or misalignment[2] != 0.0:
        turn = rotation(float(misalignment[0]), float(misalignment[1]), float(misalignment[2]))
        sensed[2:] = turned(turn.T, rates)
    return scale * sensed


def _earlier(now: Any, past: Any, kept: int, delay: float, period: float) -> Any:
    """Return the sample `delay` ago; `past` (n, 5) are the `kept` samples before `now`, newest first."""
    steps = int((delay + INSTANT) / period)
    if kept == 0:
        return now
    if steps >= kept:
        return past[kept - 1].copy()
    newer = now if steps == 0 else past[steps - 1]
    return newer + max(delay / period - steps, 0.0) * (past[steps] - newer)
