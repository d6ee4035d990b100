"""A constant matrix."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError
from quadvis_blocks._matrices import read_matrix


class MatrixGain(Block):
    """A vector times a constant matrix: ``y = gain u``, such as a state feedback.

    The sums run along the rows of the matrix, from left to right. A scalar counts as a vector of one element.
    """

    gain = Param(
        ((1.0,),), type="float64[m,n]", unit="b/a", tune=True, shown=True, doc="the matrix, row by row"
    )
    file = Param(
        "", type="file", doc="a text file with the matrix in SI units, one row a line, in place of ``gain``"
    )
    u = In("float64[n?]", unit="a", doc="a vector with an element for each column")
    y = Out("float64[m]", unit="b", doc="the product, with an element for each row")

    symbol = "gain"
    example = """
        state: {block: sources.constant, rate: fast, with: {value: [0.1, -0.2]}}
        feedback: {block: math.matrix_gain, rate: fast, with: {gain: [[-1, -1.7]]}, in: {u: state.y}}
    """

    def check(self) -> None:
        """Take the matrix from the file, if there is one."""
        if not self.file:
            return
        matrix = self.read_file("file", read_matrix)
        given = np.asarray(self.gain)
        if given.tolist() != [[1.0]] and not np.array_equal(given, matrix):
            raise ParameterError("gain", "gain must be left out where a file has the matrix")
        self.gain = matrix

    def output(self, u: Any) -> Any:
        """Return the product."""
        rows, columns = self.gain.shape
        y = np.empty(rows)
        for row in range(rows):
            total = self.gain[row, 0] * u[0]
            for column in range(1, columns):
                total += self.gain[row, column] * u[column]
            y[row] = total
        return y
