"""A continuous integrator."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, State, clip, inward
from quadvis_blocks.signal._integral import Integral


class Integrator(Integral, Block):
    """The integral of a signal over continuous time, held between limits, element by element.

    ``dy/dt = u``, ``y(0) = initial``. The integral does not wind up: at a limit it stops, and it leaves the
    limit as soon as the input points inward.
    """

    integral = State("float64[*]", continuous=True)

    def output(self) -> Any:
        """Return the integral."""
        return clip(self.integral, self.lower, self.upper)

    def update(self) -> None:
        """Return to the limit if the last solver step went beyond it."""
        self.integral = clip(self.integral, self.lower, self.upper)

    def deriv(self, u: Any) -> Any:
        """Return the input, but zero where the input would lead beyond a limit."""
        return inward(u, self.integral, self.lower, self.upper)
