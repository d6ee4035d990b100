"""A continuous integrator."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, State, inward
from quadvis_blocks._edges import LEVEL, fires
from quadvis_blocks._limits import bounded
from quadvis_blocks.signal._integral import Integral, first


class Integrator(Integral, Block):
    """The integral of a signal over continuous time, held between limits, element by element.

    ``dy/dt = u``, ``y(0) = initial``. The integral does not wind up: at a limit it stops, and it leaves the
    limit as soon as the input points inward. A reset is noticed at a solver step; from then on the integral
    goes on from ``value`` within the limits.
    """

    integral = State("float64[*]", continuous=True)

    example = """
        force: {block: sources.step, rate: continuous, with: {after: 2 m/s^2, at: 0.5 s}}
        speed: {block: signal.integrator, with: {upper: 0.8 m/s}, in: {u: force.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return 1/s."""
        return ("1", "s")

    def output(self, reset: bool, value: Any) -> Any:
        """Return the integral."""
        if fires(self.reset_on, reset, self.before, self.seen):
            return bounded(first(value, self.initial), self.lower, self.upper, self.wrap)
        return bounded(self.integral, self.lower, self.upper, self.wrap)

    def update(self, reset: bool, value: Any) -> None:
        """Go on from the value of a reset, or from the limit if the last solver step went beyond it."""
        if fires(self.reset_on, reset, self.before, self.seen):
            self.integral = first(value, self.initial)
        self.integral = bounded(self.integral, self.lower, self.upper, self.wrap)
        self.before = reset
        self.seen = True

    def deriv(self, u: Any, reset: bool) -> Any:
        """Return the input, but zero where the input would lead beyond a limit."""
        if self.reset_on == LEVEL and reset:
            return 0.0 * u
        return 1.0 * u if self.wrap else inward(u, self.integral, self.lower, self.upper)
