"""A continuous integrator."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, State, clip, inward
from quadvis_blocks.signal._integral import Integral


class Integrator(Integral, Block):
    """The integral of a signal over continuous time, held between limits, element by element.

    ``dy/dt = u``, ``y(0) = initial``. At a limit it does not wind up: it stops, and leaves as soon as the
    input points inward.
    """

    integral = State("float64[*]", continuous=True)

    def output(self) -> Any:
        """Return the integral."""
        return clip(self.integral, self.lower, self.upper)

    def update(self) -> None:
        """Take back what the last solver step went beyond a limit."""
        self.integral = clip(self.integral, self.lower, self.upper)

    def deriv(self, u: Any) -> Any:
        """Return the input, or zero where it would lead beyond a limit."""
        return inward(u, self.integral, self.lower, self.upper)
