"""Matrices by name in files: .yaml, .npz, .mat, and texts in which a name stands above its rows."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.document import YamlList, YamlNode, YamlScalar, parse_yaml
from quadvis.errors import QuadvisError, quoted
from quadvis.machine.inputs import read_input

Matrices = Mapping[str, NDArray[np.float64]]
MOST_BYTES = 10_000_000


def read_model(path: str) -> Matrices:
    """Return the matrices of a file by name, in SI units; QuadvisError says what is wrong with it."""
    data = read_input(path, MOST_BYTES)
    kind = path.rpartition(".")[2].lower()
    if kind in ("yaml", "yml"):
        found = _of_yaml(path, data)
    elif kind in ("npz", "mat"):
        found = _of_arrays(data, kind)
    else:
        found = _of_text(data.decode("utf-8", "replace"))
    for name, matrix in found.items():
        if not np.isfinite(matrix).all():
            raise QuadvisError(f"{quoted(name)} has a number that is not finite")
    return found


def wanted(matrices: Matrices, *names: str) -> NDArray[np.float64]:
    """Return the matrix that has one of these names; QuadvisError if there is none."""
    for name in names:
        if name in matrices:
            return matrices[name]
    has = ", ".join(matrices) or "nothing"
    raise QuadvisError(f"there is no {quoted(names[0])}; it has {has}")


def polynomials(matrices: Matrices) -> tuple[Any, Any]:
    """Return numerator and denominator."""
    return wanted(matrices, "numerator", "num").ravel(), wanted(matrices, "denominator", "den").ravel()


def _of_arrays(data: bytes, kind: str) -> dict[str, NDArray[np.float64]]:
    if kind == "npz":
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as held:
                arrays: dict[str, Any] = {name: held[name] for name in held.files}
        except (OSError, ValueError, EOFError, zipfile.BadZipFile):
            raise QuadvisError("it is no archive of arrays of numbers") from None
    else:
        arrays = _of_matlab(data)
    try:
        return {name: np.atleast_1d(np.asarray(array, float)) for name, array in arrays.items()}
    except (TypeError, ValueError):
        raise QuadvisError("it has variables that are no real numbers") from None


def _of_matlab(data: bytes) -> dict[str, Any]:
    from scipy.io import loadmat

    try:
        held = loadmat(io.BytesIO(data))
    except Exception:  # of a file that is none, scipy raises errors of many kinds
        raise QuadvisError("it is no MAT file of version 4 to 7.2") from None
    return {name: value for name, value in held.items() if not name.startswith("__")}


def _of_yaml(path: str, data: bytes) -> dict[str, NDArray[np.float64]]:
    root = parse_yaml(data.decode("utf-8", "replace"), path).mapping()
    return {key.text(): np.atleast_1d(_array(node)) for key, node in root.pairs()}


def _array(node: YamlNode) -> NDArray[np.float64]:
    try:
        return np.array(_numbers(node), float)
    except ValueError:
        raise node.wrong("a number, a list of numbers, or rows of one length") from None


def _numbers(node: YamlNode) -> Any:
    if isinstance(node, YamlScalar):
        return float(node.value)
    if not isinstance(node, YamlList):
        raise ValueError
    return [_numbers(child) for child in node]


def _of_text(text: str) -> dict[str, NDArray[np.float64]]:
    rows: dict[str, list[list[float]]] = {}
    name = ""
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if len(words) == 1 and words[0].isidentifier() and words[0].lower() not in ("nan", "inf", "infinity"):
            name = words[0]
            rows[name] = []
        elif words:
            rows.setdefault(name, []).append(_row(words, number, line, rows.get(name, [])))
    return {name: np.array(values) for name, values in rows.items() if values}


def _row(words: list[str], number: int, line: str, above: list[list[float]]) -> list[float]:
    try:
        row = [float(word) for word in words]
    except ValueError:
        raise QuadvisError(f"line {number} is no row of numbers: {quoted(line.strip())}") from None
    if above and len(row) != len(above[0]):
        raise QuadvisError(f"line {number} has {len(row)} numbers, the row above has {len(above[0])}")
    return row
