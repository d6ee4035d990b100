"""A function of two signals, given by a table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param
from quadvis_blocks._tables import OUTSIDE, OUTSIDE_WORDS, between, check_breakpoints, check_finite, place_in


class Lookup2d(Block):
    """A function of two signals that a table gives, bilinear between its breakpoints, element by element.

    At every pair of breakpoints the output is the value of the table, to the bit. What holds outside is said
    for each axis. NaN gives NaN.
    """

    rows = Param(type="float64[m]", unit="a", doc="breakpoints of the rows, rising")
    columns = Param(type="float64[n]", unit="b", doc="breakpoints of the columns, rising")
    values = Param(type="float64[m,n]", unit="c", tune=True, doc="the values, row by row")
    outside_rows = Param("hold", choices=OUTSIDE, doc=f"what holds outside of the rows: {OUTSIDE_WORDS}")
    outside_columns = Param("hold", choices=OUTSIDE, doc="the same for the columns")
    row = In("float64[*]", unit="a", doc="where in the rows")
    column = In("float64[*]", unit="b", doc="where in the columns")
    y = Out("float64[*]", unit="c", doc="the value of the table")

    symbol = "lookup"
    example = """
        speed: {block: sources.ramp, rate: fast, with: {slope: 10 m/s^2}}
        lift:
          block: signal.lookup_2d
          rate: fast
          with:
            rows: {value: [0, 20], unit: m/s}
            columns: {value: [0, 5, 10], unit: deg}
            values: {value: [[0, 0, 0], [0, 8, 12]], unit: N}
          in: {row: speed.y, column: 4 deg}
    """

    def check(self) -> None:
        """Refuse breakpoints that do not rise, and values that are infinite."""
        check_breakpoints("rows", self.rows)
        check_breakpoints("columns", self.columns)
        check_finite("values", self.values)

    def output(self, row: Any, column: Any) -> Any:
        """Return the value."""
        if isinstance(row, float):
            return _value(self, row, column)
        y = np.empty_like(row)
        for index in range(row.size):
            y.flat[index] = _value(self, row.flat[index], column.flat[index])
        return y


def _value(block: Any, row: float, column: float) -> float:
    """Return the value of the table for two numbers."""
    if math.isnan(row) or math.isnan(column):
        return math.nan
    i, down = place_in(block.rows, row, block.outside_rows)
    j, along = place_in(block.columns, column, block.outside_columns)
    table = block.values
    upper = between(table[i, j], table[i, j + 1], along)
    lower = between(table[i + 1, j], table[i + 1, j + 1], along)
    return between(upper, lower, down)
