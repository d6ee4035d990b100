"""A sum of signals."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError


class Sum(Block):
    """Signals added and subtracted, element by element: with ``signs: +-+``, ``y = u[0] - u[1] + u[2]``.

    The terms are added in the order of their list.
    """

    signs = Param("", type="str", doc="a + or a - for each signal, such as +-+; without signs all are added")
    u = In("float64[*]", unit="a", many=True, doc="the terms")
    y = Out("float64[*]", unit="a", doc="the sum")
    minus = Derived("bool[u]", doc="which terms are subtracted")

    symbol = "sum"
    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        offset: {block: sources.constant, rate: fast, with: {value: 20 cm}}
        error: {block: signal.sum, rate: fast, with: {signs: "+--"}, in: {u: [1 m, wave.y, offset.y]}}
    """

    def picture_signs(self) -> dict[str, str]:
        """Return the sign of each term."""
        return {f"u[{place}]": "-" if minus else "+" for place, minus in enumerate(self.minus)}

    def check(self) -> None:
        """Refuse signs that are none, or of another number than the terms."""
        count = self.entry_counts.get("u", len(self.signs))
        if set(self.signs) - set("+-") or (self.signs and len(self.signs) != count):
            known = f" of {count}" if self.entry_counts else ""
            raise ParameterError("signs", f"signs must be + or - for each signal{known}, got '{self.signs}'")
        self.minus = np.array([sign == "-" for sign in self.signs or "+" * count])

    def output(self, *u: Any) -> Any:
        """Return the sum."""
        total = -u[0] if self.minus[0] else u[0]
        for place in range(1, len(u)):
            total = total - u[place] if self.minus[place] else total + u[place]
        return total
