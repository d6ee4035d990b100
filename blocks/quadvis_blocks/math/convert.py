"""A signal of another kind."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError
from quadvis_blocks._rounding import NAMES, WORDS, rounded

KINDS = ("float64", "int64", "bool")
FLOAT, INT, BOOL = range(3)


class Convert(Block):
    """A signal of another kind: numbers of truth values, whole numbers of others, truth values of numbers.

    True is 1 and false is 0; what is not 0 is true. NaN and infinity have no whole number, and end the run.
    """

    takes = Param("bool", choices=KINDS, doc="the kind of the input")
    gives = Param("float64", choices=KINDS, shown=True, doc="the kind of the output")
    rounding = Param("nearest", choices=NAMES, doc=f"from a number to a whole one: {WORDS}")
    u = In("bool[*]", doc="the signal")
    y = Out("float64[*]", doc="the same as another kind")

    example = """
        pulses: {block: sources.pulse, rate: fast, with: {interval: 0.2 s, width: 0.1 s}}
        high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: pulses.y, b: 0.5}}
        number: {block: math.convert, rate: fast, in: {u: high.y}}
    """

    @classmethod
    def ports(cls, takes: int, gives: int) -> dict[str, Any]:
        """Return the ports of these kinds, and the method that leads from one to the other."""
        if takes == gives:
            raise ParameterError("gives", f"gives must be another kind than takes, which is {KINDS[takes]}")
        whole = cls.round if takes == FLOAT else cls.count
        return {
            "u": In(f"{KINDS[takes]}[*]", doc="the signal"),
            "y": Out(f"{KINDS[gives]}[*]", doc="the same as another kind"),
            "output": {FLOAT: cls.output, INT: whole, BOOL: cls.test}[gives],
        }

    def output(self, u: Any) -> Any:
        """Return numbers."""
        return 1.0 * u

    def count(self, u: Any) -> Any:
        """Return whole numbers of truth values."""
        return 1 * u

    def test(self, u: Any) -> Any:
        """Return what is not zero."""
        return u != 0

    def round(self, u: Any) -> Any:
        """Return whole numbers of others."""
        if isinstance(u, float):
            return int(rounded(u, self.rounding))
        y = np.empty(u.shape, np.int64)
        for index in range(u.size):
            y.flat[index] = int(rounded(u.flat[index], self.rounding))
        return y
