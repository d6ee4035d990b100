"""The inertial measurement unit on board."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, Random, State
from quadvis_blocks._random import fill_normal

DEGREE = math.pi / 180.0


class Imu(Block):
    """Roll, pitch and angular rates as an inertial unit gives them: true value, bias, drift, white noise.

    White noise is fresh at each tick of the block. The drift of each angle is a first-order Gauss-Markov
    process, exact at the block's rate and stationary from the first sample. Yaw is not measured: the camera
    does that.

    Source: section 6.2 (an IMU gives roll and pitch at a higher rate than the camera); the errors are a
    typical unit's, meant for 100 Hz.
    """

    angle_noise = Param(
        0.1 * DEGREE, unit="rad", min=0.0, tune=True, doc="white noise of roll and pitch, one sigma"
    )
    drift = Param(0.2 * DEGREE, unit="rad", min=0.0, tune=True, doc="slow drift of roll and pitch, one sigma")
    drift_time = Param(20.0, unit="s", above=0.0, tune=True, doc="correlation time of the drift")
    rate_noise = Param(
        0.5 * DEGREE, unit="rad/s", min=0.0, tune=True, doc="white noise of each rate, one sigma"
    )
    angle_bias = Param(
        (0.0, 0.0), type="float64[2]", unit="rad", tune=True, doc="constant error of roll and pitch"
    )
    rate_bias = Param(
        (0.0, 0.0, 0.0), type="float64[3]", unit="rad/s", tune=True, doc="constant error of each rate"
    )
    attitude = In("float64[3]", unit="rad", doc="true roll, pitch, yaw")
    rates = In("float64[3]", unit="rad/s", doc="true rates about roll, pitch and yaw axis")
    roll = Out(unit="rad", doc="measured roll angle")
    pitch = Out(unit="rad", doc="measured pitch angle")
    gyro = Out("float64[3]", unit="rad/s", doc="measured rates about roll, pitch and yaw axis")
    drawn = State("float64[7]")  # fresh at each tick: roll, pitch, three rates, drift of roll and pitch
    wander = State("float64[2]")  # the drifts; all in standard deviations
    stream = Random()

    def start(self) -> None:
        """Draw the first errors."""
        fill_normal(self.stream, self.drawn)
        self.wander = self.drawn[5:]

    def output(self, attitude: Any, rates: Any) -> tuple[float, float, Any]:
        """Return the measured angles and rates."""
        drawn, wander, bias = self.drawn, self.wander, self.angle_bias
        roll = attitude[0] + bias[0] + self.drift * wander[0] + self.angle_noise * drawn[0]
        pitch = attitude[1] + bias[1] + self.drift * wander[1] + self.angle_noise * drawn[1]
        return roll, pitch, rates + self.rate_bias + self.rate_noise * drawn[2:5]

    def update(self) -> None:
        """Draw the next errors."""
        keep = math.exp(-self.period / self.drift_time)
        fill_normal(self.stream, self.drawn)
        self.wander = keep * self.wander + math.sqrt(1.0 - keep * keep) * self.drawn[5:]
