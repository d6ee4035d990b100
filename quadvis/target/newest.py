"""The newest value of every signal of a run, for whoever looks: nothing of this enters the loop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.diagram.diagram import Diagram
from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError, quoted, sentence, suggestion
from quadvis.graph.names import index_text, read_name
from quadvis.output.recording import RecordedPort, ports


class Value(NamedTuple):
    """The value of a signal (SI units) at a tick; ``value`` is None before its first row."""

    name: str
    value: Any
    tick: int


class NewestValues:
    """Keeps the newest row of every block of a diagram; the taps put it there, any thread reads it."""

    def __init__(self, diagram: Diagram) -> None:
        self._diagram = diagram
        self.ports: dict[str, tuple[RecordedPort, ...]] = {
            node.path: found for node in diagram.graph.nodes if (found := ports(node)) and not node.hidden
        }
        self._rows: dict[str, tuple[int, NDArray[np.int64]]] = {}
        self.taps: Sequence[Tap] = [_NewestTap(path, self._rows) for path in self.ports]

    @property
    def names(self) -> Iterator[str]:
        """The names of all signals."""
        for path, found in self.ports.items():
            yield from (f"{path}.{port.name}" for port in found)

    def facts(self) -> list[dict[str, Any]]:
        """Return what there is to know of each signal."""
        found = []
        for path, outputs in self.ports.items():
            node = self._diagram.graph[path]
            for port in outputs:
                doc = node.block.interface.outputs[port.name].doc
                found.append({
                    "name": f"{path}.{port.name}", "type": port.type, "shape": list(port.shape),
                    "unit": port.unit, "task": node.task.name, "period": float(node.task.period),
                    "computer": node.computer, "block": node.kind, "doc": doc,
                })  # fmt: skip
        return found

    def clear(self) -> None:
        """Forget all values, before another run."""
        self._rows.clear()

    def value(self, name: str) -> Value:
        """Return the value of a signal, or of a part of it; QuadvisError if there is none of this name."""
        head, bracket, tail = name.partition("[")
        wire = read_name(self._diagram.ports.get(head, head) + bracket + tail)
        found = self.ports.get(wire.block, ()) if wire is not None else ()
        start = 0
        for port in found:
            assert wire is not None
            if port.name == wire.port:
                return self._value(wire.block, port, start, wire.index, name)
            start += port.size
        remedy = suggestion(head, [*self.names, *self._diagram.ports])
        raise QuadvisError(sentence(f"there is no signal {quoted(name)}", remedy))

    def _value(self, path: str, port: RecordedPort, start: int, index: Any, name: str) -> Value:
        tick, row = self._rows.get(path, (-1, None))
        if row is None:
            return Value(name, None, -1)
        value = port.rows(row.reshape(1, -1), start)[0]
        try:
            chosen = value[index] if index else value
        except IndexError:
            problem = f"{quoted(name)} has no element {index_text(index)}"
            raise QuadvisError(sentence(problem, f"its shape is {port.shape}")) from None
        return Value(name, chosen.tolist() if hasattr(chosen, "tolist") else chosen, tick)


class _NewestTap(Tap):
    every = 1

    def __init__(self, block: str, rows: dict[str, tuple[int, NDArray[np.int64]]]) -> None:
        self.block, self._rows = block, rows

    def take(self, tick: int, row: memoryview) -> None:
        """Keep a row."""
        self._rows[self.block] = tick, np.frombuffer(bytes(row), np.int64)

    def take_all(self, ticks: NDArray[np.int64], rows: NDArray[np.int64]) -> None:
        """Keep the last row."""
        self._rows[self.block] = int(ticks[-1]), rows[-1]
