"""Vectors and matrices of three, in plain numbers.

BLAS chooses the order of a sum by the processor. Here the order is written down, so the bits are the same
interpreted and compiled, and on every processor. On three numbers this is also faster than arrays are.
"""

from __future__ import annotations

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]  # row by row


def dot(a: Vector, b: Vector) -> float:
    """Return the inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def determinant(a: Vector, b: Vector, c: Vector) -> float:
    """Return the determinant of the matrix with these rows."""
    return dot(a, cross(b, c))


def scaled(a: Vector, factor: float) -> Vector:
    """Return factor a."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def mixed(a: Vector, p: float, b: Vector, q: float) -> Vector:
    """Return p a + q b."""
    return (p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2])


def turned(matrix: Matrix, a: Vector) -> Vector:
    """Return the product of a matrix and a column."""
    return (dot(matrix[0], a), dot(matrix[1], a), dot(matrix[2], a))


def transposed(matrix: Matrix) -> Matrix:
    """Return the matrix whose rows are the columns of this one."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    return ((a, d, g), (b, e, h), (c, f, i))
