"""A sampled integrator by the trapezoidal rule."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, State, Work
from quadvis_blocks._edges import fires
from quadvis_blocks._limits import bounded
from quadvis_blocks.signal._integral import Integral, first


class TrapezoidalIntegrator(Integral, Block):
    """The integral of a sampled signal by the trapezoidal rule (Tustin), held between limits.

    ``y[k] = x[k] + T/2 u[k]`` and ``x[k+1] = y[k] + T/2 u[k]``, each held between the limits, with
    ``x[0] = initial``: without limits ``T/2 (z + 1) / (z - 1)``, as if the input had been 0 before. The input
    has direct feedthrough. While ``freeze`` is true the sum does not change. At a reset the output is
    ``value`` within the limits, at once.
    """

    freeze = In("bool", default=False, doc="true to keep the sum as it is")
    integral = State("float64[*]")
    sum_now = Work("float64[*]")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        area: {block: signal.trapezoidal_integrator, rate: fast, in: {u: wave.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the transfer function without limits."""
        return ("T (z + 1)", "2 (z - 1)")

    def output(self, u: Any, freeze: bool, reset: bool, value: Any) -> Any:
        """Return the integral."""
        if fires(self.reset_on, reset, self.before, self.seen):
            self.sum_now = bounded(first(value, self.initial), self.lower, self.upper, self.wrap)
        elif freeze:
            self.sum_now = self.integral
        else:
            half = 0.5 * self.period * u
            self.sum_now = bounded(self.integral + half, self.lower, self.upper, self.wrap)
        return self.sum_now

    def update(self, u: Any, freeze: bool, reset: bool) -> None:
        """Add half a period of the input."""
        self.integral = self.sum_now
        if not freeze:
            half = 0.5 * self.period * u
            self.integral = bounded(self.sum_now + half, self.lower, self.upper, self.wrap)
        self.before = reset
        self.seen = True
