"""Arrays of numbers in the files of other programs: CSV, text, NumPy's .npy and .npz, MATLAB's .mat, YAML.

Files come from anybody: no pickles are read, sizes are bounded, and no contents are quoted.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadvis.document.array_text import number_of, text_arrays
from quadvis.document.node import YamlNode
from quadvis.document.reader import parse_yaml
from quadvis.errors import DiagramError, QuadvisError, quoted, sentence, suggestion
from quadvis.machine.inputs import read_input

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[Any]  # of float64, or of complex128

MOST_BYTES, MOST_NUMBERS, MOST_AXES = 64_000_000, 1_000_000, 4
NAMES_SHOWN = 8


def read_arrays(path: str) -> Mapping[str, Array]:
    """Return the arrays of a file by name; "" is the one of a file whose array has no name.

    A table of .csv or .txt is one array of two axes, rows and columns; its columns are arrays by the names in
    its first line, if that is no row of numbers. If names stand above the rows, there is an array for each
    name. Numbers may be complex. QuadvisError if the file is of another kind or unreadable.
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


def chosen(arrays: Mapping[str, Array], name: str | None) -> NDArray[np.float64]:
    """Return the array of this name, or the only one; QuadvisError if there is no such choice.

    A single number is asked for by its name.
    """
    if name is None:
        arrays = {key: array for key, array in arrays.items() if array.shape or not key}
    if name is None and "" in arrays:
        return real("", arrays[""])
    if name is None and len(arrays) == 1:
        return real(*next(iter(arrays.items())))
    if not arrays:
        raise QuadvisError("it has no arrays of numbers")
    names = [each for each in arrays if each]
    shown = ", ".join(names[:NAMES_SHOWN])
    if name is None:
        raise QuadvisError(sentence("it has several arrays", f"add 'name:' with one of {shown}"))
    if name not in names:
        remedy = suggestion(name, names) if names else "leave 'name' out"
        raise QuadvisError(sentence(f"it has no array {quoted(name)}", remedy))
    return real(name, arrays[name])


def real(name: str, array: Array) -> NDArray[np.float64]:
    """Return an array of real numbers; QuadvisError if it has others."""
    if array.dtype.kind == "c":
        raise QuadvisError(f"{_named(name)} has no real numbers")
    return array


def _named(name: str) -> str:
    return f"array {quoted(name)}" if name else "the array"


def _checked(name: str, array: Any) -> Array:
    import numpy as np

    where, found = _named(name), np.asarray(array)
    if found.dtype.kind not in "biufc":
        raise QuadvisError(f"{where} has no numbers")
    if not found.size or found.size > MOST_NUMBERS or found.ndim > MOST_AXES:
        raise QuadvisError(f"{where} has the shape {found.shape}; give at most {MOST_NUMBERS} numbers")
    numbers = found.astype(complex if found.dtype.kind == "c" else float)
    if not np.isfinite(numbers).all():
        raise QuadvisError(f"{where} has numbers that are not finite")
    return numbers


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
    from quadvis.document.mat_files import read_mat_arrays  # numpy is not needed to read a diagram

    return read_mat_arrays(data)


def _yaml(data: bytes) -> Mapping[str, Any]:
    try:
        pairs = parse_yaml(data.decode(), "").mapping().pairs()
        found = {key.value: _numbers(node) for key, node in pairs}
    except DiagramError:
        raise QuadvisError("it has no lists of numbers under names") from None
    return {name: numbers for name, numbers in found.items() if numbers is not None}


def _numbers(node: YamlNode) -> Any:
    """Return lists of numbers, or one number; None for what is neither, unless it is a list."""
    shape = node.shape()
    try:
        return node.array([None] * len(shape))
    except DiagramError:
        texts = [child.text() for child in node.items()] if len(shape) == 1 else []
        numbers = [number_of(text) for text in texts]
        if None not in numbers and numbers:
            return numbers
        if shape:
            raise
        return None


_READERS: dict[str, Callable[[bytes], Mapping[str, Any]]] = {
    ".csv": text_arrays, ".txt": text_arrays, ".npy": _npy, ".npz": _npz, ".mat": _mat,
    ".yaml": _yaml, ".yml": _yaml,
}  # fmt: skip
