"""A function of one signal, given by a table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError
from quadvis_blocks._tables import (
    LINEAR,
    OUTSIDE,
    OUTSIDE_WORDS,
    between,
    check_breakpoints,
    check_finite,
    place_in,
)

STRAIGHT, FLAT = range(2)


class Lookup1d(Block):
    """A function that a table gives: in straight lines between its breakpoints, element by element.

    At every breakpoint the output is the value of the table, to the bit. With ``interpolation: hold`` it is
    the value of the breakpoint at or below the input. NaN gives NaN.
    """

    breakpoints = Param(type="float64[k]", unit="a", doc="inputs of the table, rising")
    values = Param(type="float64[k]", unit="b", tune=True, doc="the value at each breakpoint")
    interpolation = Param("linear", choices=("linear", "hold"), doc="what holds between the breakpoints")
    outside = Param("hold", choices=OUTSIDE, doc=f"what holds outside of them: {OUTSIDE_WORDS}")
    u = In("float64[*]", unit="a", doc="the input of the table")
    y = Out("float64[*]", unit="b", doc="its value")

    symbol = "lookup"
    example = """
        throttle: {block: sources.ramp, rate: fast, with: {slope: 1 1/s}}
        thrust:
          block: signal.lookup_1d
          rate: fast
          with: {breakpoints: [0, 0.5, 1], values: {value: [0, 1, 4], unit: N}}
          in: {u: throttle.y}
    """

    def check(self) -> None:
        """Refuse breakpoints that do not rise, values that are infinite, and steps that have no slope."""
        check_breakpoints("breakpoints", self.breakpoints)
        check_finite("values", self.values)
        if self.interpolation == FLAT and self.outside == LINEAR:
            raise ParameterError("outside", "outside must be hold or refuse where the table holds its values")

    def output(self, u: Any) -> Any:
        """Return the value."""
        if isinstance(u, float):
            return _value(self, u)
        y = np.empty_like(u)
        for index in range(u.size):
            y.flat[index] = _value(self, u.flat[index])
        return y


def _value(block: Any, u: float) -> float:
    """Return the value of the table for one number."""
    if math.isnan(u):
        return u
    place, share = place_in(block.breakpoints, u, block.outside)
    first, second = block.values[place], block.values[place + 1]
    if block.interpolation == FLAT:
        return float(second if share >= 1.0 else first)
    return between(first, second, share)
