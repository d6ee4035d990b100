"""The common part of the integrators: initial value, limits, reset."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, State, element
from quadvis_blocks._edges import NAMES
from quadvis_blocks._limits import refuse_reversed

if TYPE_CHECKING:
    _Base = Block
else:  # `Integral` alone is not a block: it declares an output, but has no output method
    _Base = object


class Integral(_Base):
    """Ports, parameters and start of a block that keeps its sum in the state ``integral``."""

    initial = Param(0.0, type="float64[*?]", unit="a*s", doc="the output at the start")
    lower = Param(-math.inf, type="float64[*?]", unit="a*s", tune=True, doc="smallest output")
    upper = Param(math.inf, type="float64[*?]", unit="a*s", tune=True, doc="largest output")
    wrap = Param(False, type="bool", doc="beyond a limit go on from the other one, as an angle does")
    reset_on = Param(
        "rising", choices=NAMES, doc="what of ``reset`` resets the output; true at the start is no edge"
    )
    u = In("float64[*]", unit="a", doc="the rate of change")
    reset = In("bool", default=False, doc="sets the output to ``value``")
    value = In("float64[*]", unit="a*s", default=math.nan, doc="the output at a reset; NaN means ``initial``")
    y = Out("float64[*]", unit="a*s", doc="the integral")
    integral: State
    before = State("bool", doc="``reset`` at the tick before")
    seen = State("bool", doc="whether there was one")

    def check(self) -> None:
        """Refuse limits that exclude each other or the initial value, and angles without limits."""
        refuse_reversed(("lower", self.lower), ("upper", self.upper), equal=not self.wrap)
        beyond = (self.lower > self.initial) | (self.initial > self.upper)
        if np.any(beyond):
            found, least, most = (
                np.broadcast_to(value, np.shape(beyond))[beyond].flat[0]
                for value in (self.initial, self.lower, self.upper)
            )
            raise ParameterError("initial", f"initial must lie between {least:g} and {most:g}, got {found:g}")
        if self.wrap and not np.all(np.isfinite(np.asarray(self.upper) - self.lower)):
            raise ParameterError("wrap", "wrap must be false unless lower and upper are finite")

    def start(self) -> None:
        """Begin with the initial value."""
        self.integral = self.initial
        self.seen = False


def first(value: Any, initial: Any) -> Any:
    """Return what an output is reset to: the value, or the initial one where the value is NaN."""
    if isinstance(value, float):
        return initial if math.isnan(value) else value
    found = np.empty_like(value)
    for index in range(value.size):
        given = value.flat[index]
        found.flat[index] = element(initial, index) if math.isnan(given) else given
    return found
