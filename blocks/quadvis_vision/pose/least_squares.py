"""Least squares for a few unknowns by the normal equations and Cholesky's method, in plain numbers.

A symmetric or triangular matrix is the list of its lower triangle, row by row: element (i, j) with j <= i is
at i (i + 1) / 2 + j. So the first numbers of a list are the matrix of the first unknowns. For six unknowns
and ten equations this is faster than arrays, interpreted too, and no BLAS decides over the last bits.

Source: Golub and Van Loan, Matrix Computations, sections 4.2 and 5.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

Triangle = list[float]


def undetermined() -> Triangle:
    """Return [], which stands for a matrix that does not exist."""
    return [0.0] * 0


def squares(rows: Sequence[Sequence[float]], count: int) -> Triangle:
    """Return the sum of row' row over rows, which have `count` numbers each."""
    found = [0.0] * (count * (count + 1) // 2)
    place = 0
    for i in range(count):
        for j in range(i + 1):
            total = 0.0
            for row in rows:
                total += row[i] * row[j]
            found[place] = total
            place += 1
    return found


def factored(matrix: Triangle, count: int) -> Triangle:
    """Return the triangle L with L L' = matrix (count, count); [] if the matrix is not positive definite."""
    factor = matrix[: count * (count + 1) // 2]
    for i in range(count):
        row = i * (i + 1) // 2
        for j in range(i + 1):
            column = j * (j + 1) // 2
            rest = factor[row + j]
            for k in range(j):
                rest -= factor[row + k] * factor[column + k]
            if i != j:
                factor[row + j] = rest / factor[column + j]
            elif rest > 0:
                factor[row + j] = math.sqrt(rest)
            else:
                return undetermined()
    return factor


def solved(factor: Triangle, right: Sequence[float], count: int) -> list[float]:
    """Return the x (count,) with L L' x = right, from the triangle L and the first numbers of `right`."""
    found = [0.0] * count
    for i in range(count):
        row = i * (i + 1) // 2
        rest = right[i]
        for k in range(i):
            rest -= factor[row + k] * found[k]
        found[i] = rest / factor[row + i]
    for i in range(count - 1, -1, -1):
        rest = found[i]
        for k in range(i + 1, count):
            rest -= factor[k * (k + 1) // 2 + i] * found[k]
        found[i] = rest / factor[i * (i + 1) // 2 + i]
    return found


def inverted(factor: Triangle, count: int) -> Triangle:
    """Return the inverse of L L' (count, count) from the triangle L."""
    found = [0.0] * len(factor)
    for j in range(count):
        unit = [0.0] * count
        unit[j] = 1.0
        column = solved(factor, unit, count)
        for i in range(j, count):
            found[i * (i + 1) // 2 + j] = column[i]
    return found
