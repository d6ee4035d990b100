"""A step in time."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, Out, Param, reached


class Step(Block):
    """One value before an instant, another value from that instant on.

    ``y = before`` for t < at, ``y = after`` for t >= at.
    """

    before = Param(0.0, unit="a", tune=True, doc="value before the step")
    after = Param(1.0, unit="a", tune=True, shown=True, doc="value from the step on")
    at = Param(1.0, unit="s", tune=True, shown=True, doc="instant of the step")
    y = Out(unit="a", doc="the step")

    symbol = "step"
    stepwise = True  # a solver step that ends at a jump is without it

    example = """
        command: {block: sources.step, rate: fast, with: {before: 0 m, after: 1 m, at: 0.5 s}}
    """

    def output(self, time: float) -> Any:
        """Return the value on this side of the step."""
        return self.after if reached(time, self.at) else self.before
