"""What is left of a division."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param

MOD, REM = range(2)


class Modulo(Block):
    """What is left of a division by a whole number of times, element by element.

    ``mod`` has the sign of the divisor, ``u - divisor * floor(u / divisor)``: mod(-7, 3) = 2. ``rem`` has
    that of the dividend, ``u - divisor * fix(u / divisor)``: rem(-7, 3) = -1. A divisor of 0 ends the run.
    """

    function = Param(
        "mod",
        choices=("mod", "rem"),
        shown=True,
        doc="whose sign the result has: the divisor's, the dividend's",
    )
    u = In("float64[*]", unit="a", doc="the dividend")
    divisor = In("float64[*]", unit="a", doc="the divisor")
    y = Out("float64[*]", unit="a", doc="what is left")

    example = """
        turned: {block: sources.ramp, rate: fast, with: {slope: 400 deg/s}}
        angle: {block: math.modulo, rate: fast, in: {u: turned.y, divisor: 360 deg}}
    """

    def output(self, u: Any, divisor: Any) -> Any:
        """Return the rest."""
        if isinstance(u, float):
            return _rest(self.function, u, divisor)
        y = np.empty_like(u)
        for index in range(u.size):
            y.flat[index] = _rest(self.function, u.flat[index], divisor.flat[index])
        return y


def _rest(function: int, u: float, divisor: float) -> float:
    rest = math.copysign(abs(u) % abs(divisor), u)  # exact
    if function == MOD and rest != 0.0 and (rest < 0.0) != (divisor < 0.0):
        return rest + divisor
    return rest
