"""Two recordings of one signal compared bit by bit: where they differ first, and by how much at most."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.graph.names import index_text
from quadvis.output.recording import RecordedBlock, RecordedPort, Slots
from quadvis.output.statistics import finite

Whole = NDArray[np.int64]


@dataclass
class SignalDifference:
    """How a signal differs between two recordings.

    ``row`` is the number of the first row that differs, ``index`` its first element that does, ``old`` and
    ``new`` are the two values there. ``largest`` is the largest difference of an element (NaN if only one of
    two values is NaN), ``count`` the number of rows that differ, ``rows`` that of all.
    """

    signal: str
    port: RecordedPort
    row: int
    index: tuple[int, ...]
    old: Any
    new: Any
    largest: float
    count: int
    rows: int

    @property
    def unit(self) -> str:
        """The unit of the signal, or of the element if each has its own; "" without one."""
        units = self.port.unit.split(" ")
        place = int(np.ravel_multi_index(self.index, self.port.shape)) if len(units) > 1 else 0
        return "" if units[place] == "1" else units[place]

    @property
    def element(self) -> str:
        """The name of the first element that differs."""
        return self.signal + index_text(self.index)

    def values(self) -> tuple[str, str]:
        """Return the two values as texts that differ."""
        old, new = (_text(value) for value in (self.old, self.new))
        if old == new:
            old, new = (f"{_text(value)} (bits {_bits(value):016x})" for value in (self.old, self.new))
        return old, new

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "signal": self.signal,
            "unit": self.port.unit,
            "element": self.element,
            "values": list(self.values()),
            "largest": finite(self.largest),
            "rows": self.rows,
            "different_rows": self.count,
        }


class BlockComparison:
    """Compares the rows of a block with those of another recording of it, in the order of both."""

    def __init__(self, block: RecordedBlock) -> None:
        self._block = block
        self.rows = 0  # compared so far
        self._found: dict[str, SignalDifference] = {}

    def compare(self, old: Slots, new: Slots) -> None:
        """Compare further rows, N of each."""
        for port, start in placed(self._block):
            part = slice(start, start + port.size)
            if not np.array_equal(old[:, part], new[:, part]):
                self._note(port, start, old, new)
        self.rows += len(old)

    def _note(self, port: RecordedPort, start: int, old: Slots, new: Slots) -> None:
        """Note the difference of a port in these rows."""
        part = slice(start, start + port.size)
        different = old[:, part] != new[:, part]
        rows = np.flatnonzero(different.any(axis=1))
        values = [port.rows(slots, start).reshape(len(slots), port.size) for slots in (old, new)]
        largest = _largest(*(each[rows].astype(np.float64) for each in values))
        name = self._block.signal(port)
        found = self._found.get(name)
        if found is None:
            row = int(rows[0])
            element = int(np.flatnonzero(different[row])[0])
            index = tuple(int(each) for each in np.unravel_index(element, port.shape)) if port.shape else ()
            found = self._found[name] = SignalDifference(
                name, port, self.rows + row, index, values[0][row, element], values[1][row, element],
                0.0, 0, 0,
            )  # fmt: skip
        found.largest = float(np.maximum(found.largest, largest))
        found.count += len(rows)

    def differences(self) -> list[SignalDifference]:
        """Return the signals that differ, in the order of the ports."""
        found = [
            self._found[name]
            for port, _ in placed(self._block)
            if (name := self._block.signal(port)) in self._found
        ]
        for each in found:
            each.rows = self.rows
        return found


def placed(block: RecordedBlock) -> Iterator[tuple[RecordedPort, int]]:
    """Yield the ports of a block, each with its first slot."""
    start = 0
    for port in block.ports:
        yield port, start
        start += port.size


def _largest(old: NDArray[np.float64], new: NDArray[np.float64]) -> float:
    """Return the largest difference of two values; NaN if only one of two is NaN."""
    with np.errstate(invalid="ignore", over="ignore"):
        distance = np.abs(new - old)
    distance[(old == new) | (np.isnan(old) & np.isnan(new))] = 0.0
    return float(distance.max())


def _text(value: Any) -> str:
    return repr(value.item())


def _bits(value: Any) -> int:
    """Return the bits of a value as they are in a row."""
    return int(np.asarray(value).astype("<f8" if value.dtype.kind == "f" else "<i8").view("<u8"))
