"""Matrices in text files: one row a line, numbers apart by commas or blanks, `#` begins a comment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.inputs import read_input


def read_matrix(path: str) -> NDArray[np.float64]:
    """Return the matrix (m, n) of a file, SI units; QuadvisError names the line that is wrong."""
    rows: list[list[float]] = []
    text = read_input(path).decode("utf-8", "replace")
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            raise QuadvisError(f"line {number} is no row of numbers: {quoted(line.strip())}") from None
        if not np.isfinite(rows[-1]).all():
            raise QuadvisError(f"line {number} has a number that is not finite: {quoted(line.strip())}")
        if len(rows[-1]) != len(rows[0]):
            raise QuadvisError(f"line {number} has {len(rows[-1])} numbers, the first row has {len(rows[0])}")
    if not rows:
        raise QuadvisError("there is no row of numbers")
    return np.array(rows)
