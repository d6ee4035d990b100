"""MATLAB's files as arrays and dicts by name: versions 5 to 7 by scipy, 7.3 (HDF5) by h5py."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import Any

import numpy as np

from quadvis.errors import QuadvisError, quoted

HDF5 = b"\x89HDF\r\n\x1a\n"
PLACES = (0, 512)  # of its signature: MATLAB writes a head of its own before it
MOST_SIZE = 1 << 31  # bytes of all arrays
LEAST = 1024  # bytes that each counts for: references can lead to one array again and again
DEEPEST = 16  # structures inside of structures
CLASS = "MATLAB_class"


def read_mat(data: bytes) -> dict[str, Any]:
    """Return the variables: arrays squeezed, texts, dicts, lists. QuadvisError if damaged."""
    if any(data[place : place + len(HDF5)] == HDF5 for place in PLACES):
        return _read_hdf5(data)
    from scipy.io import loadmat  # python-control brings it

    try:
        arrays = loadmat(BytesIO(data), simplify_cells=True)
    except Exception as error:  # scipy raises many kinds for damaged files
        raise QuadvisError(f"this is no file of MATLAB that can be read: {error}") from error
    return {name: value for name, value in arrays.items() if not name.startswith("__")}


def _read_hdf5(data: bytes) -> dict[str, Any]:
    try:
        import h5py
    except ImportError as error:
        problem = "MATLAB's format 7.3 needs the package h5py"
        raise QuadvisError(f"{problem}; install 'quadvis[hdf5]', or save it by save(..., '-v7')") from error
    try:
        with h5py.File(BytesIO(data), "r") as file:
            reader = _Reader(h5py, file)
            return {name: reader.value(member, 0) for name, member in reader.members(file)}
    except QuadvisError:
        raise
    except Exception as error:  # h5py raises many kinds for damaged files
        raise QuadvisError(f"this is no file of MATLAB that can be read: {error}") from error


class _Reader:
    """Reads variables as MATLAB lays them out: last axis first, texts as numbers, cells as references."""

    def __init__(self, h5py: Any, file: Any) -> None:
        self._h5py, self._file, self._left = h5py, file, MOST_SIZE

    def members(self, group: Any) -> Iterator[tuple[str, Any]]:
        """Yield what stands in a group itself; links to other places and other files are not followed."""
        for name in group:
            if not name.startswith("#") and isinstance(group.get(name, getlink=True), self._h5py.HardLink):
                yield name, group[name]

    def value(self, member: Any, depth: int) -> Any:
        """Return a variable as `scipy.io.loadmat` simplifies it."""
        if depth > DEEPEST:
            raise QuadvisError(f"its structures are nested deeper than {DEEPEST}")
        if isinstance(member, self._h5py.Group):
            return self._structure({name: self.value(each, depth + 1) for name, each in self.members(member)})
        self._check(member)
        array = member[()]
        if self._h5py.check_ref_dtype(member.dtype) is not None:
            return [self.value(self._file[each], depth + 1) for each in np.ravel(array) if each]
        kind = member.attrs.get(CLASS, b"")
        name = kind.decode() if isinstance(kind, bytes) else str(kind)
        if "MATLAB_empty" in member.attrs:
            return "" if name == "char" else np.zeros(0)
        if name == "char":
            return "".join(map(chr, np.ravel(array)))
        if isinstance(array, bytes):
            return array.decode(errors="replace")
        squeezed = np.squeeze(np.asarray(array).T)
        return squeezed.astype(bool) if name == "logical" else squeezed

    def _structure(self, fields: dict[str, Any]) -> Any:
        """Return a structure; several of them have a list in each field, of equal lengths."""
        lengths = {len(each) if isinstance(each, list) else -1 for each in fields.values()}
        if len(lengths) != 1 or -1 in lengths:
            return fields
        return [dict(zip(fields, each, strict=True)) for each in zip(*fields.values(), strict=True)]

    def _check(self, dataset: Any) -> None:
        """Refuse numbers that lie in other files, and more of them than memory should hold."""
        if dataset.is_virtual or dataset.external:
            raise QuadvisError(f"{quoted(dataset.name)} lies in another file; save it into this one")
        self._left -= max(LEAST, dataset.nbytes)
        if self._left < 0:
            raise QuadvisError(f"its arrays have more than {MOST_SIZE / 1e6:g} MB")
