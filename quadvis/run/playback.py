"""A graph whose blocks that reach outside are replaced by what a recording has of them."""

from __future__ import annotations

import itertools
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from quadvis.block import NO_FRAME, Block
from quadvis.engine.tuning import Change
from quadvis.errors import QuadvisError, quoted
from quadvis.graph.graph import Graph, Node
from quadvis.output.recording import Slots, ports
from quadvis.run.outside import outside

Whole = NDArray[np.int64]


def with_playback(graph: Graph, rows: Mapping[str, Slots]) -> Graph:
    """Return a graph in which the blocks that reach outside do nothing but give rows, by their path.

    Each gives its rows (N, slots) in their order, one at each of its ticks, whatever its condition says,
    since a log has a row of each tick. QuadvisError if one of them has outputs between its ticks as well.
    """
    replaced = {}
    for node in outside(graph):
        if node.task.continuous and (node.block.numeric or node.block.interface.continuous):
            problem = f"block {quoted(node.path)} reaches outside and moves between two ticks"
            raise QuadvisError(f"{problem}, which no log holds; give it a rate, or say numeric=False")
        replaced[node.path] = replace(node, block=_played(node, rows.get(node.path)), inputs={}, condition="")
    return replace(graph, nodes=[replaced.get(node.path, node) for node in graph.nodes])


class _Playback(Block, numeric=False):
    """In place of a block that reaches outside: it has the same outputs, no inputs, and opens nothing."""

    _rows: ClassVar[Callable[[], Iterator[Any]]] = staticmethod(
        lambda: iter(())
    )  # its outputs, from the first

    def open(self) -> None:
        """Begin with the first row."""
        self._next = type(self)._rows()


def _played(node: Node, rows: Slots | None) -> Block:
    """Return the block that stands in for that of a node."""
    block, interface = node.block, node.block.interface
    members: dict[str, Any] = {**interface.outputs, "__module__": __name__}
    if interface.outputs:
        members["_rows"] = staticmethod(lambda: _outputs(node, rows))
        members["output"] = lambda self: next(self._next)
    made: type[Block] = type(type(block).__name__, (_Playback,), members)
    return made(period=block.period)


def _outputs(node: Node, rows: Slots | None) -> Iterator[Any]:
    """Yield the outputs of a node at each of its ticks, from its rows; frames are none."""
    columns: dict[str, Any] = {}
    start = 0
    if rows is not None:
        for port in ports(node):
            columns[port.name] = port.rows(rows, start)
            start += port.size
    names = list(node.block.interface.outputs)
    for row in itertools.count() if rows is None else range(len(rows)):
        found = tuple([columns[name][row] if name in columns else NO_FRAME for name in names])
        yield found if len(names) > 1 else found[0]


class RecordedClock:
    """Lets the ticks go that a recorded run had, and tunes parameters before the ticks before which it did.

    ``left_out`` are the ticks that it left out, as the first and the count of each run of ticks (N, 2), in
    order. ``tune`` takes all changes of a tick, which were checked together.
    """

    def __init__(
        self, left_out: Whole, changes: Sequence[Change], tune: Callable[[Sequence[Change]], None]
    ) -> None:
        self._first, self._stop = left_out[:, 0].tolist(), left_out.sum(axis=1).tolist()
        self._changes = sorted(changes, key=lambda change: change.tick)
        self._tune = tune

    def wait(self, tick: int, end: int) -> range:
        """Return the next ticks of the recorded run."""
        place = bisect_right(self._first, tick)
        while place and self._stop[place - 1] > tick:
            tick = self._stop[place - 1]
            place = bisect_right(self._first, tick)
        if tick >= end:
            return range(end, end)
        due = bisect_right(self._changes, tick, key=lambda change: change.tick)
        if due:
            self._tune(self._changes[:due])
            del self._changes[:due]
        following = [*self._first[place : place + 1], *(change.tick for change in self._changes[:1])]
        return range(tick, min(end, *following)) if following else range(tick, end)
