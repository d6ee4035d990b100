"""Signals of a file that is no log of ours, in memory, under the names that they have there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted
from quadvis.graph.graph import Index
from quadvis.graph.names import read_index
from quadvis.output.recording import RecordedBlock, RecordedPort, Recording

KINDS = {"f": "float64", "i": "int64", "u": "int64", "b": "bool"}


class ForeignBlock(RecordedBlock):
    """One signal of such a file, under the name that it has there."""

    def signal(self, port: RecordedPort) -> str:
        """Return the name of the signal."""
        return port.name


class ForeignSignals(Recording):
    """The signals of a file that is no log of ours; the names are those of the file.

    ``unplayed`` says of what else stands in the file why it is no signal.
    """

    damage = ""  # as of a log: nothing is read of a damaged file

    def __init__(self, path: Path) -> None:
        """Begin without signals."""
        super().__init__()
        self.path = path
        self.unplayed: dict[str, str] = {}

    def find(self, name: str) -> tuple[int, int, RecordedPort, Index]:
        """Return the place of a signal, see `Recording.find`."""
        if name not in self._signals and name in self.unplayed:
            raise QuadvisError(f"there is no signal {quoted(name)}: {self.unplayed[name]}")
        return super().find(name)

    def take(self, name: str, unit: str, stamps: NDArray[np.int64], values: NDArray[Any]) -> None:
        """Add a signal: stamps (N,) in ns, values (N, ...)."""
        kind = KINDS[values.dtype.kind]
        port = RecordedPort(name, kind, values.shape[1:], unit or "1")
        self.add(ForeignBlock(f"/{len(self.blocks)}", (port,)))
        slots = np.ascontiguousarray(values, "<f8" if kind == "float64" else "<i8").reshape(len(values), -1)
        self.extend(len(self.blocks) - 1, stamps, slots.view(np.int64))

    def _source(self, name: str) -> tuple[str, Index]:
        whole, bracket, rest = name.partition("[")
        index = read_index(rest.removesuffix("]")) if bracket and rest.endswith("]") else ()
        return (whole, index) if index is not None else (name, ())
