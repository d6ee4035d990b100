"""A sampled integrator."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, State, clip
from quadvis_blocks.signal._integral import Integral


class DiscreteIntegrator(Integral, Block):
    """The sum of a sampled signal times the period (forward Euler), held between limits, element by element.

    ``y[k+1] = min(max(y[k] + T u[k], lower), upper)``, ``y[0] = initial``; exact for an input that is held
    between samples. The block has no direct feedthrough. While ``freeze`` is true the sum does not change,
    for example while a mixer is saturated.
    """

    freeze = In("bool", default=False, doc="true to keep the sum as it is")
    integral = State("float64[*]")

    def output(self) -> Any:
        """Return the integral."""
        return self.integral

    def update(self, u: Any, freeze: bool) -> None:
        """Add one period of the input."""
        if not freeze:
            self.integral = clip(self.integral + self.period * u, self.lower, self.upper)
