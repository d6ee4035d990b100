"""Atmospheric turbulence with the Dryden spectra."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, Out, Param, Random, State, fill_normal

FOOT = 0.3048  # m
ROOT_3 = math.sqrt(3.0)


class Dryden(Block):
    """Wind with the turbulence of the Dryden spectra near the ground, for a craft that flies through it.

    The turbulence along the mean wind (u), across the mean wind (v) and upward (w) is white noise that has
    passed the shaping filters

        H_u = sigma_u sqrt(2 L_u / (pi V)) / (1 + L_u/V s)
        H_v = sigma_v sqrt(L_v / (pi V)) (1 + sqrt(3) L_v/V s) / (1 + L_v/V s)^2,  H_w alike,

    with the altitude h in feet, the wind W at 20 ft and the airspeed V: L_w = h and L_u = L_v = h / (0.177 +
    0.000823 h)^1.2, sigma_w = 0.1 W and sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4. The standard
    deviations along the three axes are sigma_u, sigma_v, sigma_w; the axes are independent. The samples are
    exact at any rate of the block, and stationary from the first sample on. The formulas for L and sigma hold
    from 10 to 1000 ft.

    Source: MIL-F-8785C, section 3.7, low altitude. MIL-HDBK-1797 gives the same filters for low altitude,
    with half the L_v and L_w. Filters and axes as in S. Gage, Creating a unified graphical wind turbulence
    model from multiple specifications, AIAA 2003-5529.
    """

    altitude = Param(6.0, unit="m", min=10 * FOOT, max=1000 * FOOT, doc="height above the ground")
    wind_speed = Param(
        5.0,
        unit="m/s",
        min=0.0,
        tune=True,
        shown=True,
        doc="wind at 6 m (20 ft); light, moderate and severe turbulence are 7.7, 15.4 and 23.2 m/s",
    )
    airspeed = Param(5.0, unit="m/s", above=0.0, doc="speed of the craft through the air")
    mean = Param(0.0, unit="m/s", tune=True, doc="mean wind")
    direction = Param(
        0.0, unit="rad", tune=True, doc="direction to which the mean wind blows, clockwise from x, from above"
    )
    wind = Out("float64[3]", unit="m/s", doc="velocity of the air along x, y, h")
    along = State()  # lag of u, in standard deviations
    lags = State("float64[2,2]")  # first and second lag of v and of w
    fresh = State("float64[5]")  # the random numbers of this tick
    steps = State("float64[2,5]")  # coefficients of one period, horizontal and upward; see `_step`
    stream = Random()

    example = """
        wind: {block: plant.dryden, rate: fast}
    """

    def start(self) -> None:
        """Compute the coefficients of the filters and draw the first wind."""
        lower, length = _low_altitude(self.altitude)
        self.steps[0] = _step(self.period * self.airspeed / length)
        self.steps[1] = _step(self.period * self.airspeed / lower)
        fill_normal(self.stream, self.fresh)
        fresh = self.fresh
        self.along = fresh[0]
        for axis in range(2):
            self.lags[axis, 0] = math.sqrt(0.5) * fresh[1 + axis]
            self.lags[axis, 1] = 0.5 * self.lags[axis, 0] + math.sqrt(0.125) * fresh[3 + axis]

    def output(self) -> Any:
        """Return the present wind."""
        lags, upward = self.lags, 0.1 * self.wind_speed
        level = upward * _swell(self.altitude)
        along = self.mean + level * self.along
        across = level * (ROOT_3 * lags[0, 0] + (1.0 - ROOT_3) * lags[0, 1])
        cosine, sine = math.cos(self.direction), math.sin(self.direction)
        rise = upward * (ROOT_3 * lags[1, 0] + (1.0 - ROOT_3) * lags[1, 1])
        return np.array((along * cosine - across * sine, along * sine + across * cosine, rise))

    def update(self) -> None:
        """Advance the filters by one period."""
        fill_normal(self.stream, self.fresh)
        fresh, lags, steps = self.fresh, self.lags, self.steps
        self.along = steps[0, 0] * self.along + math.sqrt(2.0) * steps[0, 2] * fresh[0]
        for axis in range(2):
            first, second = lags[axis, 0], lags[axis, 1]
            step = steps[axis]
            lags[axis, 0] = step[0] * first + step[2] * fresh[1 + axis]
            lags[axis, 1] = step[1] * first + step[0] * second + step[3] * fresh[1 + axis]
            lags[axis, 1] += step[4] * fresh[3 + axis]


def _swell(altitude: float) -> float:
    """Return the ratio of horizontal to upward turbulence, sigma_u / sigma_w, at an altitude (m)."""
    return float((0.177 + 0.000823 * altitude / FOOT) ** -0.4)


def _low_altitude(altitude: float) -> tuple[float, float]:
    """Return the scale lengths (m) L_w and L_u = L_v at an altitude (m)."""
    return altitude, altitude * _swell(altitude) ** 3


def _step(share: float) -> tuple[float, float, float, float, float]:
    """Return the coefficients k, c, l, m, o that advance two lags in series by a ``share`` of their time.

    The first lag gets white noise. Its strength gives the filter (1 + sqrt(3) s) / (1 + s)^2 = sqrt(3) p + (1
    - sqrt(3)) p^2, p = 1 / (1 + s), the variance 1. The lags a and b advance by a' = k a + l n and b' = c a +
    k b + m n + o n', where n and n' are standard normal. k and c come from the matrix exponential; l, m and o
    are the Cholesky factor of the covariance that the noise adds.
    """
    keep = math.exp(-share)
    left = math.sqrt(-0.5 * math.expm1(-2.0 * share))
    common = 0.25 * _tail(2, 2.0 * share) / left if left > 0.0 else 0.0
    rest = 0.25 * _tail(3, 2.0 * share) - common * common
    return keep, share * keep, left, common, math.sqrt(max(0.0, rest))


def _tail(order: int, x: float) -> float:
    """Return 1 - exp(-x) (1 + x + ... + x^(order - 1) / (order - 1)!), without cancellation for a small x."""
    if x > 40.0:
        return 1.0
    term = math.exp(-x)
    total = 0.0
    for power in range(1, 150):
        term *= x / power
        if power >= order:
            total += term
    return total
