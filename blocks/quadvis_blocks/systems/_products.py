"""Small products of matrices, written out: so their sums have one order, interpreted and compiled."""

from __future__ import annotations

from typing import Any

import numpy as np


def row_times(matrix: Any, row: int, vector: Any) -> float:
    """Return a row of a matrix (m, n) times a vector (n,)."""
    total = matrix[row, 0] * vector[0]
    for column in range(1, vector.size):
        total += matrix[row, column] * vector[column]
    return float(total)


def times(matrix: Any, vector: Any) -> Any:
    """Return a matrix (m, n) times a vector (n,)."""
    found = np.empty(matrix.shape[0])
    for row in range(found.size):
        found[row] = row_times(matrix, row, vector)
    return found
