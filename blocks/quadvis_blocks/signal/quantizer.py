"""A signal in steps."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, element
from quadvis_blocks._rounding import NAMES, WORDS, rounded


class Quantizer(Block):
    """A signal in steps of one size, as a converter or an encoder gives it, element by element.

    ``y = interval * round(u / interval)``. Halves are rounded away from zero, unless ``rounding`` says
    otherwise; so -u gives -y.
    """

    jumps = True
    interval = Param(
        1.0, type="float64[*?]", unit="a", above=0.0, tune=True, shown=True, doc="the size of a step"
    )
    rounding = Param("nearest", choices=NAMES, doc=WORDS)
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="a", doc="the nearest step")

    symbol = "quantizer"
    example = """
        angle: {block: sources.ramp, rate: fast, with: {slope: 1 rad/s}}
        encoder: {block: signal.quantizer, rate: fast, with: {interval: 5 deg}, in: {u: angle.y}}
    """

    def output(self, u: Any) -> Any:
        """Return the step."""
        if isinstance(u, float):
            return self.interval * rounded(u / self.interval, self.rounding)
        y = np.empty_like(u)
        for index in range(u.size):
            interval = element(self.interval, index)
            y.flat[index] = interval * rounded(u.flat[index] / interval, self.rounding)
        return y
