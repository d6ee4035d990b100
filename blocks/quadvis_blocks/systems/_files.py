"""Models of linear systems in files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block import ParameterError
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


def model_of(matrices: Matrices, names: str) -> list[NDArray[np.float64]]:
    """Return the matrices of these names, each of one letter; B is 0 if a file leaves it out."""
    return [
        np.zeros((1, 1)) if name == "B" and not {"B", "b"} & {*matrices} else matrix(matrices, name)
        for name in names
    ]


def given_model(block: Any, names: str, sampled: bool) -> list[NDArray[np.float64]]:
    """Return the matrices of a block, by its parameters or by its ``file``; ParameterError if neither says.

    ``sampled`` says that the model is one at the block's rate, with which the ``dt`` of a file must agree.
    """
    given = [np.asarray(getattr(block, name)) for name in names]
    if not block.file:
        if not any(np.any(each) for each in given):
            raise ParameterError("A", f"A must be given, or a 'file' with {', '.join(names)}")
        return given
    if any(np.any(each) for each in given):
        raise ParameterError("file", f"file must be left out where one of {', '.join(names)} is given")
    held = block.read_file("file", read_model)
    period = float(held["dt"].flat[0]) if "dt" in held else 0.0
    if period > 0.0 and not sampled:
        raise ParameterError("model", f"model must be discrete, since the file has one every {period:g} s")
    if period > 0.0 and abs(block.period - period) > 1e-9 * period:
        problem = f"file must have a model that is sampled every {block.period:g} s, as the block is"
        raise ParameterError("file", f"{problem}, got {period:g} s")
    return model_of(held, names)


def roots(matrices: Matrices) -> tuple[list[complex], list[complex], float]:
    """Return zeros, poles and gain of a file, which may leave out zeros and gain."""
    found = [
        _found(matrices, names)[1].ravel() if any(name in matrices for name in names) else np.array([])
        for names in (("zeros", "z"), ("gain", "k"))
    ]
    poles = _found(matrices, ("poles", "p"))[1].ravel()
    gain = float(real("gain", found[1])[0]) if found[1].size else 1.0
    return [complex(zero) for zero in found[0]], [complex(pole) for pole in poles], gain


def _found(matrices: Matrices, names: tuple[str, ...]) -> tuple[str, NDArray[Any]]:
    for name in names:
        if name in matrices:
            return name, matrices[name]
    has = ", ".join(matrices) or "nothing"
    raise QuadvisError(f"there is no {quoted(names[0])}; it has {has}")
