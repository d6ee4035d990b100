"""A signal whose rate of change is limited."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work, clip, element


class RateLimiter(Block):
    """A signal that follows its input no faster than the limits allow, element by element.

    ``y[k] = y[k-1] + min(max(u[k] - y[k-1], -falling T), rising T)`` with ``y[-1] = initial``, or, if no
    initial value is given, ``y[0] = u[0]``.
    """

    rising = Param(1.0, type="float64[*?]", unit="a/s", min=0.0, tune=True, shown=True, doc="fastest rise")
    falling = Param(
        1.0,
        type="float64[*?]",
        unit="a/s",
        min=0.0,
        tune=True,
        shown=True,
        doc="fastest fall, a positive number",
    )
    initial = Param(
        math.inf,
        type="float64[*?]",
        unit="a",
        doc="output before the first sample; inf: that is the first input",
    )
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="a", doc="the limited signal")
    last = State("float64[*]")
    given = Work("float64[*]")

    symbol = "rate_limiter"
    example = """
        command: {block: sources.step, rate: fast, with: {after: 1 m, at: 0.2 s}}
        ramp: {block: signal.rate_limiter, rate: fast, with: {rising: 2 m/s}, in: {u: command.y}}
    """

    def start(self) -> None:
        """Begin with the initial value."""
        self.last = self.initial

    def output(self, u: Any) -> Any:
        """Return the value that is nearest to the input within the limits."""
        if isinstance(u, float):
            self.given = _limited(u, self.last, self.rising * self.period, self.falling * self.period)
        else:
            for index in range(u.size):
                rise = element(self.rising, index) * self.period
                fall = element(self.falling, index) * self.period
                self.given.flat[index] = _limited(u.flat[index], self.last.flat[index], rise, fall)
        return self.given

    def update(self) -> None:
        """Keep the output."""
        self.last = self.given


def _limited(u: float, last: float, rise: float, fall: float) -> float:
    """Return the next output; without a last one, the input."""
    if math.isinf(last):
        return u
    return float(last + clip(u - last, -fall, rise))
