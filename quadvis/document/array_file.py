"""Arrays of numbers in the files of other programs: CSV, NumPy's .npy and .npz, MATLAB's .mat, and YAML.

Files come from anybody: no pickles are read, sizes are bounded, and no contents are quoted.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadvis.document.node import YamlNode
from quadvis.document.reader import parse_yaml
from quadvis.errors import DiagramError, QuadvisError, quoted, sentence, suggestion
from quadvis.machine.inputs import read_input
from quadvis.units import UnitError, parse_number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

MOST_BYTES, MOST_NUMBERS, MOST_AXES = 64_000_000, 1_000_000, 4
NAMES_SHOWN = 8


def read_arrays(path: str) -> Mapping[str, Array]:
    """Return the arrays of a file by name; "" is the one of a file whose array has no name.

    A table of CSV is one array of two axes, rows and columns; its columns are arrays by the names in its
    first line, if that is no row of numbers. QuadvisError if the file is of another kind or unreadable.
    """
    kind = Path(path).suffix.lower()
    if kind not in _READERS:
        known = ", ".join(_READERS)
        raise QuadvisError(sentence(f"the arrays of a '{kind}' file cannot be read", f"give one of {known}"))
    data = read_input(path, MOST_BYTES)
    try:
        return {name: _checked(name, array) for name, array in _READERS[kind](data).items()}
    except QuadvisError:
        raise
    except Exception as error:  # readers of formats raise whatever a damaged file makes them
        raise QuadvisError(f"it is no {kind} file that can be read: {type(error).__name__}") from error


def chosen(arrays: Mapping[str, Array], name: str | None) -> Array:
    """Return the array of this name, or the only one; QuadvisError if there is no such choice."""
    if name is None and "" in arrays:
        return arrays[""]
    if name is None and len(arrays) == 1:
        return next(iter(arrays.values()))
    if not arrays:
        raise QuadvisError("it has no arrays of numbers")
    names = [each for each in arrays if each]
    shown = ", ".join(names[:NAMES_SHOWN])
    if name is None:
        raise QuadvisError(sentence("it has several arrays", f"add 'name:' with one of {shown}"))
    if name not in names:
        remedy = suggestion(name, names) if names else "leave 'name' out"
        raise QuadvisError(sentence(f"it has no array {quoted(name)}", remedy))
    return arrays[name]


def _checked(name: str, array: Any) -> Array:
    import numpy as np

    where = f"array {quoted(name)}" if name else "the array"
    found = np.asarray(array)
    if found.dtype.kind not in "biuf":
        raise QuadvisError(f"{where} has no real numbers")
    if not found.size or found.size > MOST_NUMBERS or found.ndim > MOST_AXES:
        raise QuadvisError(f"{where} has the shape {found.shape}; give at most {MOST_NUMBERS} numbers")
    numbers = found.astype(float)
    if not np.isfinite(numbers).all():
        raise QuadvisError(f"{where} has numbers that are not finite")
    return numbers


def _csv(data: bytes) -> Mapping[str, Any]:
    text = data.decode("utf-8-sig")
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    separator = next((sign for sign in (",", ";", "\t") if lines and sign in lines[0]), None)
    rows = (
        [line.split() for line in lines]
        if separator is None
        else list(csv.reader(lines, delimiter=separator))
    )
    names = [cell.strip() for cell in rows[0]] if rows and not all(map(_is_number, rows[0])) else []
    rows = rows[1:] if names else rows
    if not rows or len({len(row) for row in rows}) != 1:
        raise QuadvisError("its lines are not equally long rows of numbers")
    try:
        table = [[parse_number(cell.strip()) for cell in row] for row in rows]
    except UnitError:
        raise QuadvisError("its lines are not all rows of numbers") from None
    columns = {name: [row[index] for row in table] for index, name in enumerate(names) if name}
    return {"": table, **columns}


def _is_number(cell: str) -> bool:
    try:
        parse_number(cell.strip())
    except UnitError:
        return False
    return True


def _npy(data: bytes) -> Mapping[str, Any]:
    import numpy as np

    return {"": np.load(io.BytesIO(data), allow_pickle=False)}


def _npz(data: bytes) -> Mapping[str, Any]:
    import zipfile

    import numpy as np

    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > 10 * MOST_BYTES:
            raise QuadvisError("it is too large when unpacked")
    with np.load(io.BytesIO(data), allow_pickle=False) as found:
        return {name: found[name] for name in found.files}


def _mat(data: bytes) -> Mapping[str, Any]:
    if data[:10] == b"MATLAB 7.3":
        raise QuadvisError(sentence("it is of version 7.3", "save it with '-v7'"))
    from scipy.io import loadmat

    found: dict[str, Any] = loadmat(io.BytesIO(data))
    arrays = {name: array for name, array in found.items() if hasattr(array, "dtype")}
    return {name: array for name, array in arrays.items() if array.dtype.kind in "biuf"}


def _yaml(data: bytes) -> Mapping[str, Any]:
    try:
        root = parse_yaml(data.decode(), "")
        return {key.value: _numbers(node) for key, node in root.mapping().pairs() if node.shape()}
    except DiagramError:
        raise QuadvisError("it has no lists of numbers under names") from None


def _numbers(node: YamlNode) -> Any:
    return node.array([None] * len(node.shape()))


_READERS: dict[str, Callable[[bytes], Mapping[str, Any]]] = {
    ".csv": _csv, ".npy": _npy, ".npz": _npz, ".mat": _mat, ".yaml": _yaml, ".yml": _yaml,
}  # fmt: skip
