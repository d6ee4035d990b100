"""Play in a drive."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work, element


class Backlash(Block):
    """A signal through a drive with play: the output moves only where the input pushes it.

    ``y[k] = max(u[k] - width/2, min(u[k] + width/2, y[k-1]))``, ``y[-1] = initial``, element by element.
    """

    width = Param(
        1.0, type="float64[*?]", unit="a", min=0.0, tune=True, shown=True, doc="the play, from end to end"
    )
    initial = Param(0.0, type="float64[*?]", unit="a", doc="the output before the first sample")
    u = In("float64[*]", unit="a", doc="the side that drives")
    y = Out("float64[*]", unit="a", doc="the side that is driven")
    last = State("float64[*]")
    driven = Work("float64[*]")

    symbol = "backlash"
    example = """
        motor: {block: sources.sine, rate: fast, with: {amplitude: 10 deg, frequency: 1 Hz}}
        gear: {block: signal.backlash, rate: fast, with: {width: 2 deg}, in: {u: motor.y}}
    """

    def start(self) -> None:
        """Begin with the initial output."""
        self.last = self.initial

    def output(self, u: Any) -> Any:
        """Return where the driven side is."""
        self.driven = _pushed(u, self.last, self.width)
        return self.driven

    def update(self) -> None:
        """Keep where it is."""
        self.last = self.driven


def _pushed(u: Any, last: Any, width: Any) -> Any:
    if isinstance(u, float):
        return max(u - 0.5 * width, min(u + 0.5 * width, last))
    y = np.empty_like(u)
    for index in range(u.size):
        half = 0.5 * element(width, index)
        y.flat[index] = max(u.flat[index] - half, min(u.flat[index] + half, last.flat[index]))
    return y
