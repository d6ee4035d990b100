"""A continuous integrator of an acceleration, with hard stops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, State, element
from quadvis_blocks._limits import refuse_reversed

SHORT = 0.1  # of a solver step: a rebound that would last no longer is none


class SecondOrderIntegrator(Block):
    """The integral of a signal and the integral of that, between hard stops, element by element.

    ``dx/dt = v``, ``dv/dt = u``. At a stop ``v`` becomes ``-restitution v``, as of a ball that falls on a
    floor: 0 stops it, 1 loses nothing. The impact is located between two ticks. Where a rebound would be over
    within a tenth of a solver step, x rests at the stop until u points inward again.

    Source: Newton's law of impact; Simulink's Integrator, Second-Order Limited.
    """

    initial = Param(0.0, type="float64[*?]", unit="a*s^2", doc="x at the start")
    initial_rate = Param(0.0, type="float64[*?]", unit="a*s", doc="v at the start")
    lower = Param(-math.inf, type="float64[*?]", unit="a*s^2", doc="the lower stop of x")
    upper = Param(math.inf, type="float64[*?]", unit="a*s^2", doc="the upper stop of x")
    restitution = Param(0.0, min=0.0, max=1.0, tune=True, doc="speed after an impact by that before")
    u = In("float64[*]", unit="a", doc="the acceleration")
    x = Out("float64[*]", unit="a*s^2", doc="the integral of v, such as a position")
    v = Out("float64[*]", unit="a*s", doc="the integral of u, such as a speed")
    place = State("float64[*]", continuous=True)
    speed = State("float64[*]", continuous=True)
    rests = State("bool[*]", doc="whether it rests at a stop")

    example = """
        ball:
          block: signal.second_order_integrator
          with: {initial: 1 m, lower: 0 m, restitution: 0.8}
          in: {u: -9.81 m/s^2}
    """

    def check(self) -> None:
        """Refuse stops that exclude each other or the initial value."""
        refuse_reversed(("lower", self.lower), ("upper", self.upper), equal=False)
        beyond = np.asarray((self.lower > self.initial) | (self.initial > self.upper))
        if beyond.any():
            found, least, most = (
                np.broadcast_to(value, beyond.shape)[beyond].flat[0]
                for value in (self.initial, self.lower, self.upper)
            )
            raise ParameterError("initial", f"initial must lie between {least:g} and {most:g}, got {found:g}")

    def start(self) -> None:
        """Begin with the initial values."""
        self.place = self.initial
        self.speed = self.initial_rate
        at_stop = (self.initial == self.lower) | (self.initial == self.upper)
        self.rests = at_stop & (self.initial_rate == 0.0)

    def output(self) -> tuple[Any, Any]:
        """Return both integrals."""
        if isinstance(self.place, float):
            return min(max(self.place, self.lower), self.upper), self.speed
        x = np.empty_like(self.place)
        for index in range(x.size):
            least, most = element(self.lower, index), element(self.upper, index)
            x.flat[index] = min(max(self.place.flat[index], least), most)
        return x, 1.0 * self.speed

    def deriv(self, u: Any) -> tuple[Any, Any]:
        """Return both derivatives: zero while it rests at a stop to which u points."""
        if isinstance(u, float):
            return _slopes(self.place, self.speed, self.rests, u, self.lower)
        first, second = np.empty_like(u), np.empty_like(u)
        for index in range(u.size):
            lower = element(self.lower, index)
            first.flat[index], second.flat[index] = _slopes(
                self.place.flat[index], self.speed.flat[index], self.rests.flat[index], u.flat[index], lower
            )
        return first, second

    def update(self, u: Any) -> None:
        """Leave a stop from which u points, and rebound from one that the step before has missed."""
        _meet_stops(self, u)

    def crossing(self) -> Any:
        """Return how far each element is from its stops: from all lower ones, then from all upper ones."""
        if isinstance(self.place, float):
            if self.rests:
                return np.ones(2)
            return np.array((self.place - self.lower, self.upper - self.place))
        size = self.place.size
        found = np.ones(2 * size)
        for index in range(size):
            if not self.rests.flat[index]:
                found[index] = self.place.flat[index] - element(self.lower, index)
                found[size + index] = element(self.upper, index) - self.place.flat[index]
        return found

    def event(self, u: Any) -> None:
        """Rebound."""
        _meet_stops(self, u)


def _meet_stops(self: Any, u: Any) -> None:
    """Let what happens at the stops happen."""
    if isinstance(u, float):
        self.place, self.speed, self.rests = _rebound(
            self.place, self.speed, self.rests, u, self.lower, self.upper, self.restitution, self.period
        )
        return
    for index in range(u.size):
        self.place.flat[index], self.speed.flat[index], self.rests.flat[index] = _rebound(
            self.place.flat[index], self.speed.flat[index], self.rests.flat[index], u.flat[index],
            element(self.lower, index), element(self.upper, index), self.restitution, self.period,
        )  # fmt: skip


def _slopes(x: float, v: float, rests: bool, u: float, lower: float) -> tuple[float, float]:
    """Return the derivatives of x and v."""
    if rests and (u <= 0.0 if x <= lower else u >= 0.0):
        return 0.0, 0.0
    return v, u


def _rebound(
    x: float, v: float, rests: bool, u: float, lower: float, upper: float, restitution: float, period: float
) -> tuple[float, float, bool]:
    """Return x, v, and whether it rests, after what happens at a stop."""
    if rests:
        return x, v, u <= 0.0 if x <= lower else u >= 0.0
    inward = 1.0 if x <= lower else -1.0
    if lower < x < upper or inward * v > 0.0:
        return x, v, False
    stop = lower if x <= lower else upper
    after, push = -restitution * v, -inward * u
    if push > 0.0 and 2.0 * abs(after) <= SHORT * period * push:
        return stop, 0.0, True
    return stop, after, False
