"""What a graph says of its loops before anything runs: their blocks, their period, and what is an instant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Set
from fractions import Fraction
from math import isfinite, lcm
from typing import Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.graph.graph import Graph, Node, Task

LONGEST = 20_000  # ticks of the longest hyperperiod
WAITS = ("delay", "latency")  # the parameters (s) that say how long a value waits in a block


class AnalysisError(QuadvisError):
    """A diagram that cannot be linearised: the obstacle, and the way out."""


def hyperperiod(graph: Graph, tasks: Iterable[Task]) -> int:
    """Return the number of ticks after which these tasks are due together again."""
    span = lcm(*(graph.ticks(task.period) for task in tasks))
    if span > LONGEST:
        time = float(span * graph.tick)
        problem = f"the rates of the loop repeat only after {time:g} s, {span} ticks"
        raise AnalysisError(f"{problem}; choose rates that fit into each other")
    return span


def full(graph: Graph, blocks: Set[str], at: float) -> Fraction:
    """Return the first time (s) from ``at`` on at which all that waits in these blocks has begun to come out.

    Before that a dead time looks like a wire that leads nowhere.
    """
    waits = (wait for node in graph.nodes if node.path in blocks for wait in _waits(node))
    return max([Fraction(at), *waits])


def _waits(node: Node) -> Iterator[Fraction]:
    """Yield how long (s) values wait in a block, with two of its periods to come and go."""
    interface = node.block.interface
    if not any(declared.signal.scalar == "float64" for declared in interface.outputs.values()):
        return
    for name in WAITS:
        param = interface.params.get(name)
        if param is not None and param.unit == "s" and param.signal.scalar == "float64":
            waits = float(np.max(getattr(node.block, name)))
            if isfinite(waits):
                yield Fraction(waits) + 2 * node.task.period


def instants_of(graph: Graph) -> set[tuple[str, str]]:
    """Return the outputs that are instants or ages: declared in seconds, or in seconds and made from such."""
    found = {
        (node.path, port)
        for node in graph.nodes
        for port, declared in node.block.interface.outputs.items()
        if _in_seconds(declared.units)
    }
    while True:
        more = {
            (node.path, port)
            for node in graph.nodes
            for port, units in node.units.items()
            if _in_seconds(units) and any((wire.block, wire.port) in found for _, wire in node.wires())
        }
        if more <= found:
            return found
        found |= more


def _in_seconds(units: Sequence[Any]) -> bool:
    return bool(units) and all(str(unit) == "s" for unit in units)


def blocks_on_loops(graph: Graph) -> set[str]:
    """Return the blocks that lie on a loop of wires."""
    readers: dict[str, set[str]] = {node.path: set() for node in graph.nodes}
    for node in graph.nodes:
        for _, wire in node.wires():
            readers[wire.block].add(node.path)
    return {path for path in readers if path in _downstream(readers, path)}


def blocks_between(graph: Graph, begin: Iterable[str], end: Iterable[str]) -> set[str]:
    """Return the blocks on the way of a change of some blocks to others, both included."""
    readers: dict[str, set[str]] = {node.path: set() for node in graph.nodes}
    sources: dict[str, set[str]] = {node.path: set() for node in graph.nodes}
    for node in graph.nodes:
        for _, wire in node.wires():
            readers[wire.block].add(node.path)
            sources[node.path].add(wire.block)
    reached = set().union(*(_downstream(readers, path) | {path} for path in begin))
    return reached.intersection(*[set().union(*(_downstream(sources, path) | {path} for path in end))])


def _downstream(readers: dict[str, set[str]], path: str) -> set[str]:
    found: set[str] = set()
    waiting = list(readers[path])
    while waiting:
        reader = waiting.pop()
        if reader not in found:
            found.add(reader)
            waiting.extend(readers[reader])
    return found
