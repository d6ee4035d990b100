"""Where the signals of scopes lie in the rows of blocks, by the declarations of the blocks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from types import MappingProxyType
from typing import NamedTuple, Self

import numpy as np

from quadvis.errors import QuadvisError, quoted
from quadvis.graph.graph import Graph, Task, rank
from quadvis.graph.names import index_text, read_name
from quadvis.output.recording import RecordedBlock, RecordedPort, Recording, ports


class ScopeTrace(NamedTuple):
    """One number of a signal: its name and unit, its block, its slot in the block's row and its type."""

    name: str
    unit: str
    block: str
    slot: int
    type: str


class ScopePlan(NamedTuple):
    """What a scope reads: its traces, and the trace that may trigger it, if there is one.

    ``ports`` are the signals as they were named, each a recorded port of a block ("/craft", "position[2]"),
    in the order of the traces. The scope samples at the ticks of the task ``rate``, every ``spacing`` ticks:
    the fastest among its blocks. ``grid`` are the blocks of this task.
    """

    traces: tuple[ScopeTrace, ...]
    trigger: ScopeTrace | None
    ports: tuple[tuple[str, RecordedPort], ...]
    rate: str
    spacing: int
    grid: tuple[str, ...]

    @property
    def columns(self) -> tuple[ScopeTrace, ...]:
        """All that is read of rows: the traces, and last the trigger, if there is one."""
        return self.traces if self.trigger is None else (*self.traces, self.trigger)


class ScopeSource:
    """The blocks whose rows come, and the time base: what scopes need to know of a graph.

    ``tick`` is the base tick (s), ``ports`` has the sources of the ports of parts.
    """

    def __init__(
        self,
        tick: Fraction,
        blocks: Iterable[tuple[RecordedBlock, Task]],
        ports: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        found = list(blocks)
        self.tick = tick
        self.tasks = {block.path.strip("/"): task for block, task in found}
        self._signals = Recording([block for block, _ in found], ports)

    @classmethod
    def of(cls, graph: Graph, parts: Mapping[str, str] = MappingProxyType({})) -> Self:
        """Return the source of a graph's signals; ``parts`` has the sources of the ports of parts."""
        nodes = [node for node in graph.nodes if not node.hidden and ports(node)]
        blocks = [(RecordedBlock(f"/{node.path}", ports(node), node.task.name), node.task) for node in nodes]
        return cls(graph.tick, blocks, parts)

    @property
    def names(self) -> tuple[str, ...]:
        """All signals."""
        return self._signals.names

    @property
    def blocks(self) -> tuple[str, ...]:
        """The paths of the blocks."""
        return tuple(self.tasks)

    def plan(self, signals: Sequence[str], trigger: str = "") -> ScopePlan:
        """Return what a scope of these signals reads; QuadvisError if there is no such signal."""
        traces = [each for name in signals for each in self._traces(name)]
        cause = self._traces(trigger) if trigger else []
        if len(cause) > 1:
            problem = f"{quoted(trigger)} has {len(cause)} elements"
            raise QuadvisError(f"{problem}; name one of them as the TriggerSignal, such as {cause[0].name!r}")
        paths = dict.fromkeys(each.block for each in (*traces, *cause))
        if not paths:
            return ScopePlan((), None, (), "", 1, ())
        task = min((self.tasks[path] for path in paths), key=rank)
        return ScopePlan(
            tuple(traces),
            cause[0] if cause else None,
            tuple(self._port(name) for name in signals),
            task.name,
            int(task.period / self.tick),
            tuple(path for path in paths if self.tasks[path] == task),
        )

    def _traces(self, name: str) -> list[ScopeTrace]:
        """Return the elements of a signal, each under its own name."""
        block, start, port, index = self._signals.find(name)
        chosen = np.arange(port.size).reshape(port.shape)[index]
        unit = self._signals.port(name).unit.split(" ")
        units = unit if len(unit) > 1 else unit * chosen.size
        path = self._signals.blocks[block].path.strip("/")
        named = read_name(name)
        plain, own = name.partition("[")[0], bool(named and named.index)
        traces: list[ScopeTrace] = []
        for each, place in zip(chosen.flat, np.ndindex(chosen.shape), strict=True):
            # Of "a.y[1:3]" the elements keep their numbers; those of a part's port are counted from 0.
            element = np.unravel_index(int(each), port.shape) if own else place
            text = f"{plain}{index_text(tuple(map(int, element)))}" if chosen.ndim or own else name
            traces.append(ScopeTrace(text, units[len(traces)], path, start + int(each), port.type))
        return traces

    def _port(self, name: str) -> tuple[str, RecordedPort]:
        """Return a signal as a port that is recorded by the name under which it was asked for."""
        plain, bracket, inside = name.partition("[")
        path, _, port = plain.rpartition(".")
        found = self._signals.port(name)
        return f"/{path}", RecordedPort(port + bracket + inside, "float64", found.shape, found.unit)
