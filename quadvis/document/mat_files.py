"""MATLAB's files as arrays and dicts by name: versions 5 to 7 by scipy, 7.3 (HDF5) by h5py.

All that quadvis reads of such a file, recordings and matrices, it reads here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any

import numpy as np

from quadvis.errors import QuadvisError, quoted

HDF5 = b"\x89HDF\r\n\x1a\n"
PLACES = (0, 512)  # of its signature: MATLAB writes a head of its own before it
MOST_SIZE = 1 << 31  # bytes of all arrays
LEAST = 1024  # bytes that each counts for: references can lead to one array again and again
DEEPEST = 16  # structures inside of structures
CLASS, EMPTY = "MATLAB_class", "MATLAB_empty"
COMPLEX = ("real", "imag")  # the members of a number in a file of version 7.3
NUMBERS = "biufc"  # kinds of numpy's types


def read_mat(data: bytes) -> dict[str, Any]:
    """Return the variables: arrays squeezed, texts, dicts, lists. QuadvisError if damaged."""
    if _is_hdf5(data):
        return _read_hdf5(data, _Reader.value)
    return _read_early(data, simplify_cells=True)


def read_mat_arrays(data: bytes) -> dict[str, Any]:
    """Return the arrays of numbers, with the axes that MATLAB gives them. QuadvisError if damaged."""
    found = _read_hdf5(data, _Reader.array) if _is_hdf5(data) else _read_early(data)
    arrays = {name: value for name, value in found.items() if hasattr(value, "dtype")}
    return {name: array for name, array in arrays.items() if array.dtype.kind in NUMBERS}


def _is_hdf5(data: bytes) -> bool:
    return any(data[place : place + len(HDF5)] == HDF5 for place in PLACES)


def _read_early(data: bytes, **options: bool) -> dict[str, Any]:
    from scipy.io import loadmat  # python-control brings it

    try:
        arrays = loadmat(BytesIO(data), **options)
    except Exception as error:  # scipy raises many kinds for damaged files
        raise _damaged(error) from error
    return {name: value for name, value in arrays.items() if not name.startswith("__")}


def _read_hdf5(data: bytes, read: Callable[[_Reader, Any], Any]) -> dict[str, Any]:
    try:
        import h5py
    except ImportError as error:
        problem = "MATLAB's format 7.3 needs the package h5py"
        raise QuadvisError(f"{problem}; install 'quadvis[hdf5]', or save it by save(..., '-v7')") from error
    try:
        with h5py.File(BytesIO(data), "r") as file:
            reader = _Reader(h5py, file)
            return {name: read(reader, member) for name, member in reader.members(file)}
    except QuadvisError:
        raise
    except Exception as error:  # h5py raises many kinds for damaged files
        raise _damaged(error) from error


def _damaged(error: Exception) -> QuadvisError:
    """Return what is said of a damaged file, of which nothing is quoted."""
    return QuadvisError(f"it is no .mat file that can be read: {type(error).__name__}")


class _Reader:
    """Reads variables as MATLAB lays them out: last axis first, texts as numbers, cells as references."""

    def __init__(self, h5py: Any, file: Any) -> None:
        self._h5py, self._file, self._left = h5py, file, MOST_SIZE

    def members(self, group: Any) -> Iterator[tuple[str, Any]]:
        """Yield what stands in a group itself; links to other places and other files are not followed."""
        for name in group:
            if not name.startswith("#") and isinstance(group.get(name, getlink=True), self._h5py.HardLink):
                yield name, group[name]

    def array(self, member: Any) -> Any:
        """Return a variable that is an array of numbers with its axes; None if it is none."""
        if isinstance(member, self._h5py.Group) or self._h5py.check_ref_dtype(member.dtype) is not None:
            return None
        self._check(member)
        name = self._class(member)
        if name == "char":
            return None
        return np.zeros((0, 0)) if EMPTY in member.attrs else self._numbers(member[()], name)

    def value(self, member: Any, depth: int = 0) -> Any:
        """Return a variable as `scipy.io.loadmat` simplifies it."""
        if depth > DEEPEST:
            raise QuadvisError(f"its structures are nested deeper than {DEEPEST}")
        if isinstance(member, self._h5py.Group):
            return self._structure({name: self.value(each, depth + 1) for name, each in self.members(member)})
        self._check(member)
        array = member[()]
        if self._h5py.check_ref_dtype(member.dtype) is not None:
            return [self.value(self._file[each], depth + 1) for each in np.ravel(array) if each]
        name = self._class(member)
        if EMPTY in member.attrs:
            return "" if name == "char" else np.zeros(0)
        if name == "char":
            return "".join(map(chr, np.ravel(array)))
        if isinstance(array, bytes):
            return array.decode(errors="replace")
        return np.squeeze(self._numbers(array, name))

    @staticmethod
    def _class(member: Any) -> str:
        kind = member.attrs.get(CLASS, b"")
        return kind.decode() if isinstance(kind, bytes) else str(kind)

    @staticmethod
    def _numbers(array: Any, name: str) -> Any:
        """Return an array of a class of MATLAB's in the order of its axes there."""
        found = np.asarray(array).T
        if found.dtype.names == COMPLEX:
            found = found[COMPLEX[0]] + 1j * found[COMPLEX[1]]
        return found.astype(bool) if name == "logical" else found

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
