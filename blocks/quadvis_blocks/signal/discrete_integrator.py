"""A sampled integrator."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, State, copied
from quadvis_blocks._edges import fires
from quadvis_blocks._limits import bounded
from quadvis_blocks.signal._integral import Integral, first


class DiscreteIntegrator(Integral, Block):
    """The sum of a sampled signal times the period (forward Euler), held between limits, element by element.

    ``y[k+1] = min(max(y[k] + T u[k], lower), upper)``, ``y[0] = initial``; exact for an input that is held
    between samples. The input has no direct feedthrough. While ``freeze`` is true the sum does not change,
    for example while a mixer is saturated. At a reset the output is ``value`` within the limits, at once.
    Block `signal.trapezoidal_integrator` takes the mean of two samples.
    """

    freeze = In("bool", default=False, doc="true to keep the sum as it is")
    integral = State("float64[*]")

    example = """
        error: {block: sources.constant, rate: fast, with: {value: 0.5 m}}
        integral:
          block: signal.discrete_integrator
          rate: fast
          with: {lower: -0.2 m*s, upper: 0.2 m*s}
          in: {u: error.y}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the transfer function without limits."""
        return ("T", "z - 1")

    def output(self, reset: bool, value: Any) -> Any:
        """Return the integral."""
        if fires(self.reset_on, reset, self.before, self.seen):
            return bounded(first(value, self.initial), self.lower, self.upper, self.wrap)
        return copied(self.integral)

    def update(self, u: Any, freeze: bool, reset: bool, value: Any) -> None:
        """Add one period of the input."""
        if fires(self.reset_on, reset, self.before, self.seen):
            self.integral = bounded(first(value, self.initial), self.lower, self.upper, self.wrap)
        if not freeze:
            self.integral = bounded(self.integral + self.period * u, self.lower, self.upper, self.wrap)
        self.before = reset
        self.seen = True
