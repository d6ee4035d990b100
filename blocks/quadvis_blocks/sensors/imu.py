"""The inertial measurement unit (IMU) on board."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import INSTANT, Block, In, Out, Param, Random, State, fill_normal, random_signs
from quadvis_blocks._angles import askew, rotation, turned, wrapped
from quadvis_blocks._craft import GRAVITY
from quadvis_blocks._delay import check_delay

DEGREE = math.pi / 180.0
GIVEN, RANDOM = range(2)
CAPACITY = 128
WIDTH = 8  # of what is sensed: roll, pitch, three rates, three forces


class Imu(Block):
    """Roll, pitch, angular rates and specific force as an inertial unit gives them: truth and errors.

    The errors are a bias, a drift and white noise. The specific force is the acceleration without gravity:
    the thrust and the air's force over the mass, along the axes of the craft. It is the mean since the tick
    before, as of a unit that integrates, and comes from the ``velocity``; without one it is NaN.

    The unit sits on the craft turned by ``misalignment``, multiplies what it measures by ``scale``, and gives
    it ``delay`` later, with straight lines between ticks; the first sample stands for all before it. The
    other errors add to that. By default the unit has none of these three errors. Away from the middle of the
    craft it would also feel its turning; it sits in the middle here.

    White noise is drawn anew at each tick of the block. The drift of each angle and rate is a first-order
    Gauss-Markov process, exact at the block's rate and stationary from the first sample. With ``bias_sign:
    random`` each bias is a size, and gets a random sign of its own at the start of a run. The noise, the
    drift of the rates, the errors of the force and the signs have separate random streams, so turning one on
    does not change the others. The unit does not measure yaw: the camera does.

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
    force_noise = Param(
        0.1, unit="m/s^2", min=0.0, tune=True, doc="white noise of each specific force, one sigma"
    )
    force_drift = Param(
        0.02, unit="m/s^2", min=0.0, tune=True, doc="slow drift of each specific force, one sigma"
    )
    force_bias = Param(
        (0.0, 0.0, 0.0),
        type="float64[3]",
        unit="m/s^2",
        tune=True,
        doc="constant error of each specific force",
    )
    scale = Param(1.0, above=0.0, tune=True, doc="measured over true, of angles, rates and forces")
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
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
    velocity = In(
        "float64[3]",
        unit="m/s",
        default=(math.nan,) * 3,
        doc="true velocity along x, y, h; NaN if there is none",
    )
    roll = Out(unit="rad", doc="measured roll angle")
    pitch = Out(unit="rad", doc="measured pitch angle")
    gyro = Out("float64[3]", unit="rad/s", doc="measured rates about roll, pitch and yaw axis")
    specific_force = Out(
        "float64[3]", unit="m/s^2", nan=True, doc="acceleration without gravity: forward, right, down"
    )
    stamp = Out(unit="s", doc="instant of the measurement")
    drawn = State("float64[7]")  # drawn at each tick: roll, pitch, three rates, drift of roll and pitch
    wander = State("float64[2]")  # the drifts; all in standard deviations
    rate_drawn = State("float64[3]")
    rate_wander = State("float64[3]")
    signs = State("float64[5]")  # of the biases of roll, pitch and three rates
    force_drawn = State("float64[6]")  # noise of three forces, and of their drifts
    force_wander = State("float64[3]")
    force_signs = State("float64[3]")  # of the biases of the forces
    before = State("float64[6]")  # attitude and velocity at the tick before; velocity NaN at the first
    past = State(f"float64[{CAPACITY},{WIDTH}]")  # what was sensed before this tick, newest first
    kept = State("int64")
    stream = Random()
    rate_stream = Random()
    force_stream = Random()
    sign_stream = Random()

    example = """
        truth:
          block: sources.table
          rate: fast
          with:
            times: {value: [0, 0.5, 1], unit: s}
            values: {value: [[0, 0, 0], [5, 3, 0], [0, 0, 0]], unit: deg}
        rates: {block: signal.derivative, rate: fast, in: {u: truth.y}}
        imu: {block: sensors.imu, rate: fast, in: {attitude: truth.y, rates: rates.rate}}
    """

    def start(self) -> None:
        """Draw the signs of the biases and the first errors."""
        fill_normal(self.stream, self.drawn)
        self.wander = self.drawn[5:]
        fill_normal(self.rate_stream, self.rate_wander)
        fill_normal(self.force_stream, self.force_drawn)
        self.force_wander = self.force_drawn[3:]
        self.before[3:] = math.nan
        self.signs[:] = 1.0
        self.force_signs[:] = 1.0
        if self.bias_sign == RANDOM:
            random_signs(self.sign_stream, self.signs)
            random_signs(self.sign_stream, self.force_signs)

    def check(self) -> None:
        """Refuse a delay that holds more samples than there is room for."""
        check_delay(self.delay, CAPACITY, self.period)

    def output(
        self, attitude: Any, rates: Any, velocity: Any, time: float
    ) -> tuple[float, float, Any, Any, float]:
        """Return the measured angles, rates and forces, and the instant of the measurement."""
        drawn, wander, bias, signs = self.drawn, self.wander, self.angle_bias, self.signs
        force = _force(attitude, velocity, self.before, self.period, self.gravity)
        true = _sensed(attitude, rates, force, self.misalignment, self.scale)
        if self.delay > 0.0:
            true = _earlier(true, self.past, self.kept, self.delay, self.period)
        roll = true[0] + signs[0] * bias[0] + self.drift * wander[0] + self.angle_noise * drawn[0]
        pitch = true[1] + signs[1] * bias[1] + self.drift * wander[1] + self.angle_noise * drawn[1]
        slow = signs[2:] * self.rate_bias + self.rate_drift * self.rate_wander
        gyro = true[2:5] + slow + self.rate_noise * drawn[2:5]
        lasting = self.force_signs * self.force_bias + self.force_drift * self.force_wander
        felt = true[5:] + lasting + self.force_noise * self.force_drawn[:3]
        for axis in range(3):
            if math.isnan(felt[axis]):
                felt[axis] = math.nan  # the sign of a NaN that was computed depends on the engine
        return roll, pitch, gyro, felt, time - self.delay

    def update(self, attitude: Any, rates: Any, velocity: Any) -> None:
        """Keep this sample for later, and draw the next errors."""
        if self.delay > 0.0:
            self.past[1:] = self.past[:-1].copy()
            force = _force(attitude, velocity, self.before, self.period, self.gravity)
            self.past[0] = _sensed(attitude, rates, force, self.misalignment, self.scale)
            self.kept = min(self.kept + 1, CAPACITY)
        self.before[:3] = attitude
        self.before[3:] = velocity
        keep = math.exp(-self.period / self.drift_time)
        step = math.sqrt(1.0 - keep * keep)
        fill_normal(self.stream, self.drawn)
        self.wander = keep * self.wander + step * self.drawn[5:]
        if self.rate_drift > 0.0:
            fill_normal(self.rate_stream, self.rate_drawn)
            self.rate_wander = keep * self.rate_wander + step * self.rate_drawn
        fill_normal(self.force_stream, self.force_drawn)
        self.force_wander = keep * self.force_wander + step * self.force_drawn[3:]


def _sensed(attitude: Any, rates: Any, force: Any, mount: Any, scale: float) -> Any:
    """Return roll, pitch, three rates and forces (8,) about the axes of the unit, times its scale."""
    sensed = np.zeros(WIDTH)
    sensed[:2] = askew(attitude, mount)[:2]
    sensed[2:5] = rates
    sensed[5:] = force
    if mount[0] != 0.0 or mount[1] != 0.0 or mount[2] != 0.0:
        turn = rotation(float(mount[0]), float(mount[1]), float(mount[2])).T
        sensed[2:5] = turned(turn, rates)
        sensed[5:] = turned(turn, force)
    return scale * sensed


def _force(attitude: Any, velocity: Any, before: Any, period: float, gravity: float) -> Any:
    """Return the mean specific force (3,) since the tick before, forward, right and down.

    `before` (6,) are the attitude and the velocity at that tick. Without one, the craft is taken as at rest.
    """
    middle, change = attitude.copy(), 0.0 * velocity
    if not math.isnan(before[3]):
        for axis in range(3):
            middle[axis] -= 0.5 * wrapped(float(attitude[axis] - before[axis]))
        change = velocity - before[3:]
    felt = np.array((change[0] / period, change[1] / period, -change[2] / period - gravity))
    return turned(rotation(float(middle[0]), float(middle[1]), float(middle[2])).T, felt)


def _earlier(now: Any, past: Any, kept: int, delay: float, period: float) -> Any:
    """Return the sample `delay` ago; `past` (n, 8) are the `kept` samples before `now`, newest first."""
    steps = int((delay + INSTANT) / period)
    if kept == 0:
        return now
    if steps >= kept:
        return past[kept - 1].copy()
    newer = now if steps == 0 else past[steps - 1]
    return newer + max(delay / period - steps, 0.0) * (past[steps] - newer)
