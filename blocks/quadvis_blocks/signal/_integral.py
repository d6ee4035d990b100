"""The common part of the integrators: an initial value between limits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from quadvis.block import Block, In, Out, Param, ParameterError, State

if TYPE_CHECKING:
    _Base = Block
else:  # `Integral` alone is not a block: it declares an output, but has no output method
    _Base = object


class Integral(_Base):
    """Ports, parameters and start of a block that keeps its sum in the state ``integral``."""

    initial = Param(0.0, unit="a*s", doc="every element of the output at the start")
    lower = Param(-math.inf, unit="a*s", tune=True, doc="smallest output")
    upper = Param(math.inf, unit="a*s", tune=True, doc="largest output")
    u = In("float64[*]", unit="a", doc="the rate of change")
    y = Out("float64[*]", unit="a*s", doc="the integral")
    integral: State

    def check(self) -> None:
        """Refuse an initial value beyond the limits."""
        if not self.lower <= self.initial <= self.upper:
            limits = f"{self.lower:g} and {self.upper:g}"
            raise ParameterError("initial", f"initial must lie between {limits}, got {self.initial:g}")

    def start(self) -> None:
        """Begin with the initial value."""
        self.integral = self.initial
