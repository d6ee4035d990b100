"""A range in which a signal has no effect."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, element
from quadvis_blocks._limits import refuse_reversed


class DeadZone(Block):
    """A signal without the part of it that lies between two limits, element by element.

    ``y = u - upper`` above ``upper``, ``u - lower`` below ``lower``, 0 between. With both at 0, ``y = u``.
    """

    lower = Param(-0.5, type="float64[*?]", unit="a", tune=True, shown=True, doc="lower end of the zone")
    upper = Param(0.5, type="float64[*?]", unit="a", tune=True, shown=True, doc="upper end of the zone")
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="a", doc="what is beyond the zone")

    symbol = "dead_zone"
    example = """
        stick: {block: sources.sine, rate: fast, with: {amplitude: 1, frequency: 1 Hz}}
        command: {block: signal.dead_zone, rate: fast, with: {lower: -0.1, upper: 0.1}, in: {u: stick.y}}
    """

    def check(self) -> None:
        """Refuse a lower end above the upper one."""
        refuse_reversed(("lower", self.lower), ("upper", self.upper))

    def output(self, u: Any) -> Any:
        """Return what is beyond the zone."""
        if isinstance(u, float):
            return _beyond(u, self.lower, self.upper)
        y = np.empty_like(u)
        for index in range(u.size):
            y.flat[index] = _beyond(u.flat[index], element(self.lower, index), element(self.upper, index))
        return y


def _beyond(u: float, lower: float, upper: float) -> float:
    if u > upper:
        return u - upper
    if u < lower:
        return u - lower
    return 0.0 * u
