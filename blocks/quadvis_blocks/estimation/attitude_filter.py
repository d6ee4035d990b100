"""Angle and rate about one axis, with their disturbances."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import INSTANT, Block, In, Out, Param, State, Work
from quadvis_blocks._angles import wrapped
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep

CAPACITY = 128
DEGREE = math.pi / 180.0


class AttitudeFilter(Block):
    """Angle, rate, torque disturbance and bias of the gyro about one axis: roll, pitch or yaw.

    A Kalman filter for ``angle' = rate``, ``rate' = torque + disturbance``. Angle and rate are measured, the
    rate with a bias. The disturbance (a trim error) and the bias wander slowly. The torque is that of the
    rotors from now to the next tick, from `estimation.rotor_state`.

    An angle may be late, for example the heading that a camera sees. With a ``stamp`` the angle is compared
    with the estimate of that instant, and the difference corrects the present estimate. An angle is new if
    its stamp is news; without a stamp an angle is new at each tick. Innovations are limited to ``gate``
    standard deviations, so that a single wrong measurement has little effect, and a lasting difference wins.

    Error: a lasting error of the measured angle goes into the estimate in full. A late angle corrects like an
    angle in time; this is accurate while the latency is short compared with the time constant of the filter.
    An angle older than 127 ticks is not used.
    """

    angle = In(unit="rad", doc="measured angle; NaN if there is none")
    gyro = In(unit="rad/s", doc="measured angular rate; NaN if there is none")
    torque = In(unit="rad/s^2", doc="torque over inertia until the next tick")
    stamp = In(unit="s", default=math.nan, doc="instant at which the angle was measured; NaN means now")
    valid = In("bool", default=True, doc="whether the angle is good")
    estimate = Out(unit="rad", doc="angle in (-pi, pi]")
    angular_rate = Out(unit="rad/s", doc="angular rate, without the gyro's bias")
    disturbance = Out(unit="rad/s^2", doc="torque over inertia in addition to the known one")
    bias = Out(unit="rad/s", doc="reading of the gyro at rest")
    covariance = Out(
        "float64[4,4]",
        unit="rad^2 rad^2/s rad^2/s^2 rad^2/s rad^2/s rad^2/s^2 rad^2/s^3 rad^2/s^2 "
        "rad^2/s^2 rad^2/s^3 rad^2/s^4 rad^2/s^3 rad^2/s rad^2/s^2 rad^2/s^3 rad^2/s^2",
        doc="covariance of angle, rate, disturbance and bias",
    )

    angle_noise = Param(
        0.1 * DEGREE, unit="rad", above=0.0, tune=True, doc="white noise of the angle, one sigma"
    )
    rate_noise = Param(
        0.5 * DEGREE, unit="rad/s", above=0.0, tune=True, doc="white noise of the rate, one sigma"
    )
    torque_noise = Param(0.1, unit="rad/s^1.5", min=0.0, tune=True, doc="white noise of the torque")
    disturbance_wander = Param(
        0.01, unit="rad/s^2.5", min=0.0, tune=True, doc="wander of the disturbance: deviation after 1 s"
    )
    bias_wander = Param(
        0.01 * DEGREE, unit="rad/s^1.5", min=0.0, tune=True, doc="wander of the bias: deviation after 1 s"
    )
    gate = Param(5.0, above=0.0, tune=True, doc="standard deviations to which innovations are limited")
    initial_sigma = Param(
        (5.0 * DEGREE, 5.0 * DEGREE, 0.1, 0.5 * DEGREE),
        type="float64[4]", unit="rad rad/s rad/s^2 rad/s", above=0.0, doc="deviations at the start",
    )  # fmt: skip

    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )

    mean = State("float64[4]")  # before the measurements of this tick
    spread = State("float64[4,4]")
    past = State(f"float64[{CAPACITY}]")  # angles, not wrapped, after the measurements; newest first
    kept = State("int64")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    mean_now = Work("float64[4]")  # with the measurements of this tick
    spread_now = Work("float64[4,4]")

    example = """
        turn: {block: sources.sine, rate: fast, with: {amplitude: 10 deg, frequency: 1 Hz}}
        gyro: {block: signal.derivative, rate: fast, in: {u: turn.y}}
        filter:
          block: estimation.attitude_filter
          rate: fast
          in: {angle: turn.y, gyro: gyro.rate, torque: 0 rad/s^2}
    """

    def start(self) -> None:
        """Begin at zero, with the deviations ``initial_sigma``."""
        begin(self.stamps)
        for index in range(4):
            self.spread[index, index] = self.initial_sigma[index] ** 2

    def output(
        self, angle: float, gyro: float, stamp: float, valid: bool, time: float
    ) -> tuple[float, float, float, float, Any]:
        """Return the estimate with the measurements of this tick."""
        self.mean_now = self.mean
        self.spread_now = self.spread
        mean, spread = self.mean_now, self.spread_now
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        new, late = valid and self.verdict == NEWS, time - self.moment
        off = _off(angle, late, self.past, self.kept, float(mean[0]), self.period) if new else math.nan
        _measure(mean, spread, off, gyro, self.angle_noise, self.rate_noise, self.gate)
        return wrapped(float(mean[0])), float(mean[1]), float(mean[2]), float(mean[3]), spread

    def update(self, torque: float, stamp: float, time: float) -> None:
        """Carry the estimate to the next tick."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        self.mean = self.mean_now
        self.spread = self.spread_now
        mean, spread = self.mean, self.spread
        self.past[1:] = self.past[:-1].copy()
        self.past[0] = mean[0]
        self.kept = min(self.kept + 1, CAPACITY)
        _predict(
            mean, spread, torque, self.period, self.torque_noise, self.disturbance_wander, self.bias_wander
        )


def _off(angle: float, late: float, past: Any, kept: int, now: float, period: float) -> float:
    """Return the difference of a measured angle from the estimate `late` seconds ago; NaN if unknown."""
    ticks, rounding = late / period, INSTANT / period
    if not math.isfinite(angle) or ticks > min(kept, CAPACITY - 1) + rounding:
        return math.nan
    steps = int(ticks)
    share = ticks - steps
    newer = now if steps == 0 else float(past[steps - 1])
    older = newer if share < rounding else float(past[steps])
    return wrapped(angle - newer - share * (older - newer))


def _measure(
    mean: Any, spread: Any, off: float, gyro: float, angle_noise: float, rate_noise: float, gate: float
) -> None:
    """Correct by an angle, with the difference `off` from its estimate, and by a gyro; NaN is skipped."""
    if not math.isnan(off):
        _correct(mean, spread, spread[0].copy(), float(spread[0, 0]), off, angle_noise, gate)
    if math.isfinite(gyro):
        towards = spread[1] + spread[3]
        of_rate = float(towards[1] + towards[3])
        _correct(mean, spread, towards, of_rate, gyro - float(mean[1] + mean[3]), rate_noise, gate)


def _correct(
    mean: Any, spread: Any, towards: Any, variance: float, off: float, noise: float, gate: float
) -> None:
    """Correct by a number with the difference `off`; `towards` (4,) is its covariance with the state."""
    total = variance + noise * noise
    limit = gate * math.sqrt(total)
    mean += towards * (min(max(off, -limit), limit) / total)
    spread -= towards.reshape(4, 1) * (towards / total)


def _predict(
    mean: Any, spread: Any, torque: float, step: float, noise: float, wander: float, bias_wander: float
) -> None:
    """Carry the estimate over a step (s) with a torque (rad/s^2)."""
    total = torque + float(mean[2])
    mean[0] += step * float(mean[1]) + 0.5 * step * step * total
    mean[1] += step * total
    half = 0.5 * step * step
    spread[0] += step * spread[1] + half * spread[2]
    spread[1] += step * spread[2]
    spread[:, 0] += step * spread[:, 1] + half * spread[:, 2]
    spread[:, 1] += step * spread[:, 2]
    white, random = noise * noise, wander * wander
    spread[0, 0] += white * step**3 / 3.0 + random * step**5 / 20.0
    spread[1, 1] += white * step + random * step**3 / 3.0
    spread[2, 2] += random * step
    spread[3, 3] += bias_wander * bias_wander * step
    angle_rate = white * half + random * step**4 / 8.0
    spread[0, 1] += angle_rate
    spread[1, 0] += angle_rate
    spread[0, 2] += random * step**3 / 6.0
    spread[2, 0] += random * step**3 / 6.0
    spread[1, 2] += random * half
    spread[2, 1] += random * half
