"""A product of signals."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError


class Product(Block):
    """Signals multiplied and divided, element by element: with ``signs: "**/"``, ``y = u[0] * u[1] / u[2]``.

    ``scale`` is a scalar that multiplies all elements. The unit of the output is that of the product. A
    division by zero ends the run.
    """

    signs = Param(
        "", type="str", doc="a * or a / for each signal, such as */; without signs all are multiplied"
    )
    u = In("float64[*]", unit="a", many=True, doc="the factors")
    scale = In(unit="b", default=1.0, doc="a scalar that multiplies all elements")
    y = Out("float64[*]", unit="a*b", doc="the product")
    divides = Derived("bool[u]", doc="which signals divide")

    example = """
        force: {block: sources.sine, rate: fast, with: {amplitude: 2 N, frequency: 1 Hz}}
        speed: {block: sources.constant, rate: fast, with: {value: 3 m/s}}
        power: {block: math.product, rate: fast, in: {u: [force.y, speed.y]}}
    """

    @classmethod
    def ports(cls, u: int, signs: str) -> dict[str, Any]:
        """Return a unit for each factor, and that of the product."""
        above = [f"*a_{k}" for k in range(u) if signs[k : k + 1] != "/"]
        below = [f"/a_{k}" for k in range(u) if signs[k : k + 1] == "/"]
        return {
            "u": [In("float64[*]", unit=f"a_{k}", doc="a factor or a divisor") for k in range(u)],
            "y": Out("float64[*]", unit=f"b{''.join(above + below)}", doc="the product"),
        }

    def picture_formula(self) -> tuple[str, ...]:
        """Return the sign of the product."""
        return ("÷",) if self.divides.all() else ("×",)  # noqa: RUF001

    def picture_signs(self) -> dict[str, str]:
        """Return the sign of each factor."""
        return {f"u[{place}]": "÷" if divides else "×" for place, divides in enumerate(self.divides)}  # noqa: RUF001

    def check(self) -> None:
        """Refuse signs that are none, or of another number than the factors."""
        count = self.entry_counts.get("u", len(self.signs))
        if set(self.signs) - set("*/") or (self.signs and len(self.signs) != count):
            known = f" of {count}" if self.entry_counts else ""
            raise ParameterError("signs", f"signs must be * or / for each signal{known}, got '{self.signs}'")
        self.divides = np.array([sign == "/" for sign in self.signs or "*" * count])

    def output(self, scale: float, *u: Any) -> Any:
        """Return the product."""
        product = scale / u[0] if self.divides[0] else scale * u[0]
        for place in range(1, len(u)):
            product = product / u[place] if self.divides[place] else product * u[place]
        return product
