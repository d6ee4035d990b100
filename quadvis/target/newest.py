"""The newest value of every signal of a run, for whoever looks: nothing of this enters the loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.diagram.diagram import Diagram
from quadvis.engine.taps import Tap
from quadvis.output.recording import RecordedBlock, RecordedPort, Recording, ports


class SignalPlace(NamedTuple):
    """The slots of a signal in the rows of its block, and its type ("float64", "int64" or "bool").

    ``width`` is how many slots a row has.
    """

    block: str
    width: int
    slots: NDArray[np.intp]
    type: str


class NewestValues:
    """Keeps the newest row of every block of a diagram; the taps put it there, any thread reads it."""

    def __init__(self, diagram: Diagram) -> None:
        self._diagram = diagram
        self.ports: dict[str, tuple[RecordedPort, ...]] = {
            node.path: found for node in diagram.graph.nodes if (found := ports(node)) and not node.hidden
        }
        self._paths = list(self.ports)
        blocks = [RecordedBlock(f"/{path}", found) for path, found in self.ports.items()]
        self._signals = Recording(blocks, diagram.ports)
        self._rows: dict[str, NDArray[np.int64]] = {}
        self.taps: Sequence[Tap] = [_NewestTap(path, self._rows) for path in self.ports]

    @property
    def names(self) -> Sequence[str]:
        """The names of all signals."""
        return self._signals.names

    def facts(self) -> list[dict[str, Any]]:
        """Return what there is to know of each signal; ``also`` has its names at the ports of parts."""
        also: dict[str, list[str]] = {}
        for alias, source in self._diagram.ports.items():
            also.setdefault(source, []).append(alias)
        found = []
        for path, outputs in self.ports.items():
            node = self._diagram.graph[path]
            for port in outputs:
                doc = node.block.interface.outputs[port.name].doc
                name = f"{path}.{port.name}"
                found.append({
                    "name": name, "also": also.get(name, []), "type": port.type, "shape": list(port.shape),
                    "unit": port.unit, "task": node.task.name, "period": float(node.task.period),
                    "computer": node.computer, "block": node.kind, "doc": doc,
                })  # fmt: skip
        return found

    def clear(self) -> None:
        """Forget all values, before another run."""
        self._rows.clear()

    def place(self, name: str) -> SignalPlace:
        """Return where a signal, or a part of it, is in a row; QuadvisError if there is none of this name."""
        block, start, port, index = self._signals.find(name)
        slots = np.arange(start, start + port.size).reshape(port.shape)[index].ravel()
        path = self._paths[block]
        return SignalPlace(path, sum(each.size for each in self.ports[path]), slots, port.type)

    def row(self, block: str) -> NDArray[np.int64] | None:
        """Return the newest row of a block (slots); None before the first one."""
        return self._rows.get(block)

    def value(self, name: str) -> Any:
        """Return the newest value of a signal, or of a part of it, in SI units; None before its first row.

        QuadvisError if there is none of this name.
        """
        block, start, port, index = self._signals.find(name)
        row = self._rows.get(self._paths[block])
        if row is None:
            return None
        value = port.rows(row.reshape(1, -1), start)[0]
        return (value[index] if index else value).tolist()


class _NewestTap(Tap):
    every = 1

    def __init__(self, block: str, rows: dict[str, NDArray[np.int64]]) -> None:
        self.block, self._rows = block, rows

    def take(self, tick: int, row: memoryview) -> None:
        """Keep a row."""
        self._rows[self.block] = np.frombuffer(bytes(row), np.int64)

    def take_all(self, ticks: NDArray[np.int64], rows: NDArray[np.int64]) -> None:
        """Keep the last row."""
        self._rows[self.block] = rows[-1]
