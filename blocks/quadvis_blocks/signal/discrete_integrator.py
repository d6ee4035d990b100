"""A sampled integrator."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, ParameterError, State
from quadvis_blocks.signal._elements import clip


class DiscreteIntegrator(Block):
    """The sum of a sampled signal times the period (forward Euler), held between limits, element by element.

    ``y[k+1] = min(max(y[k] + T u[k], lower), upper)``, ``y[0] = initial``; exact for an input that is held
    between samples. No direct feedthrough. While ``freeze`` is true it stands still, e.g. while a mixer is
    saturated.
    """

    initial = Param(0.0, unit="a*s", doc="every element of the output at the first sample")
    lower = Param(-math.inf, unit="a*s", tune=True, doc="smallest output")
    upper = Param(math.inf, unit="a*s", tune=True, doc="largest output")
    u = In("float64[*]", unit="a", doc="the rate of change")
    freeze = In("bool", default=False, doc="true to stand still")
    y = Out("float64[*]", unit="a*s", doc="the integral")
    integral = State("float64[*]")

    def check(self) -> None:
        """Refuse an initial value beyond the limits."""
        if not self.lower <= self.initial <= self.upper:
            limits = f"{self.lower:g} and {self.upper:g}"
            raise ParameterError("initial", f"initial must lie between {limits}, got {self.initial:g}")

    def start(self) -> None:
        """Begin with the initial value."""
        self.integral = self.initial

    def output(self) -> Any:
        """Return the integral."""
        return self.integral

    def update(self, u: Any, freeze: bool) -> None:
        """Add one period of the input."""
        if not freeze:
            self.integral = clip(self.integral + self.period * u, self.lower, self.upper)
