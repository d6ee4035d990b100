"""Models of linear systems in files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.document.array_file import read_arrays, real
from quadvis.errors import QuadvisError, quoted

Matrices = Mapping[str, NDArray[Any]]
read_model = read_arrays  # one reader, so that a file is read once for blocks and for values of parameters


def wanted(matrices: Matrices, *names: str) -> NDArray[np.float64]:
    """Return the matrix that has one of these names; QuadvisError if there is none of real numbers."""
    return real(*_found(matrices, names))


def polynomials(matrices: Matrices) -> tuple[Any, Any]:
    """Return numerator and denominator."""
    return wanted(matrices, "numerator", "num").ravel(), wanted(matrices, "denominator", "den").ravel()


def matrix(matrices: Matrices, name: str) -> NDArray[np.float64]:
    """Return the matrix of this name, in capitals or not, with two axes."""
    return np.atleast_2d(wanted(matrices, name, name.lower()))


def _found(matrices: Matrices, names: tuple[str, ...]) -> tuple[str, NDArray[Any]]:
    for name in names:
        if name in matrices:
            return name, matrices[name]
    has = ", ".join(matrices) or "nothing"
    raise QuadvisError(f"there is no {quoted(names[0])}; it has {has}")
