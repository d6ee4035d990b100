"""A continuous integrator."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, ParameterError, State
from quadvis_blocks.signal._elements import clip, inward


class Integrator(Block):
    """The integral of a signal over continuous time, held between limits, element by element.

    ``dy/dt = u``, ``y(0) = initial``. At a limit it does not wind up: it stops, and leaves as soon as the
    input points inward.
    """

    initial = Param(0.0, unit="a*s", doc="every element of the output at the start")
    lower = Param(-math.inf, unit="a*s", tune=True, doc="smallest output")
    upper = Param(math.inf, unit="a*s", tune=True, doc="largest output")
    u = In("float64[*]", unit="a", doc="the rate of change")
    y = Out("float64[*]", unit="a*s", doc="the integral")
    integral = State("float64[*]", continuous=True)

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
        return clip(self.integral, self.lower, self.upper)

    def update(self) -> None:
        """Take back what the last solver step went beyond a limit."""
        self.integral = clip(self.integral, self.lower, self.upper)

    def deriv(self, u: Any) -> Any:
        """Return the input, or zero where it would lead beyond a limit."""
        return inward(u, self.integral, self.lower, self.upper)
