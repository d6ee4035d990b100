"""A signal given by points in time."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Out, Param, ParameterError

LINEAR, HOLD = range(2)


class Table(Block):
    """A vector that follows the rows of a table; before the first row and after the last it is that row.

    With ``interpolation: linear`` the vector moves in straight lines between the rows. With ``hold`` it
    steps from row to row.
    """

    times = Param(type="float64[k]", unit="s", doc="instant of each row, increasing")
    values = Param(type="float64[k,n]", unit="a", doc="one row for each instant")
    interpolation = Param("linear", choices=("linear", "hold"), doc="what happens between the rows")
    y = Out("float64[n]", unit="a", doc="the vector")

    symbol = "lookup"
    example = """
        path:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 0.5, 1], unit: s}, values: {value: [[0, 0], [1, 0], [1, 1]], unit: m}}
    """

    def check(self) -> None:
        """Refuse times that do not increase, or a number of times that is not the number of rows."""
        if len(self.times) != len(self.values):
            problem = f"times must have one entry for each of the {len(self.values)} rows of values"
            raise ParameterError("times", f"{problem}, got {len(self.times)}")
        if (np.diff(self.times) <= 0.0).any():
            raise ParameterError("times", "times must increase from row to row")
        self.stepwise = self.interpolation == HOLD

    def output(self, time: float) -> Any:
        """Return the vector at this time."""
        times, values = self.times, self.values
        after = 0
        while after < len(times) and times[after] <= time:
            after += 1
        if after == 0:
            return values[0].copy()
        if after == len(times) or self.interpolation == HOLD:
            return values[after - 1].copy()
        share = (time - times[after - 1]) / (times[after] - times[after - 1])
        return values[after - 1] + share * (values[after] - values[after - 1])
