"""The signals at which an analysis opens a graph: each passes a block that adds a disturbance.

The signal of an output passes it on the way to all readers, that of an input on the way to its block alone,
or to the blocks of its part that read it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Shape
from quadvis.diagram.sections.cuts import CutSignal
from quadvis.graph.graph import Constant, Graph, Node, Wire
from quadvis.graph.order import execution_order


class Break(Block):
    """A signal to which a disturbance is added on the way to its readers."""

    u = In("float64[*]", unit="a", doc="the signal as its block gives it")
    added = In("float64[*]", unit="a", default=0.0, doc="what is added to it")
    y = Out("float64[*]", unit="a", nan=True, doc="the signal as others read it")

    def output(self, u: Any, added: Any) -> Any:
        """Return the sum."""
        return u + added


def break_path(block: str, port: str) -> str:
    """Return the path of the block at a port; no block of a diagram can have this path."""
    return f"{block}.{port}"


def with_breaks(graph: Graph, signals: Iterable[CutSignal]) -> Graph:
    """Return the graph with a break at the port of each of the signals, otherwise unchanged."""
    ends = {(signal.block, signal.port): signal for signal in signals}
    entries = _Entries([signal for signal in ends.values() if signal.feed is not None])
    opened = {port for port, signal in ends.items() if signal.feed is None}
    nodes = entries.nodes(graph, opened)
    for node in graph.nodes:
        inputs = {
            name: entries.rerouted(node.path, name, _rerouted(source, opened))
            for name, source in node.inputs.items()
        }
        mine = sorted(port for block, port in opened if block == node.path)
        for port in mine:
            if port in inputs:
                nodes.append(_break(node, port, inputs[port]))
                inputs[port] = Wire(break_path(node.path, port), "y")
        nodes.append(replace(node, inputs=inputs))
        nodes += [_break(node, port, Wire(node.path, port)) for port in mine if port not in inputs]
    # A break before a block without feedthrough may belong later in the tick than this block.
    return replace(graph, nodes=execution_order(nodes)[0])


def _rerouted(source: Wire | Constant, opened: set[tuple[str, str]]) -> Wire | Constant:
    if isinstance(source, Wire) and (source.block, source.port) in opened:
        return replace(source, block=break_path(source.block, source.port), port="y")
    return source


class _Entries:
    """Breaks at inputs of parts. What leads through several of them, inner ones last, passes each."""

    def __init__(self, signals: Iterable[CutSignal]) -> None:
        self._signals = sorted(signals, key=lambda signal: signal.block.count("/"))

    def nodes(self, graph: Graph, opened: set[tuple[str, str]]) -> list[Node]:
        """Return the blocks that break; each runs with the block that gives its signal."""
        found = []
        for number, signal in enumerate(self._signals):
            assert signal.feed is not None
            producer = graph[signal.feed.block]
            whole = producer.shape(signal.feed.port)
            shape = np.empty(whole)[signal.feed.index].shape
            plain = Wire(signal.feed.block, signal.feed.port, signal.feed.index)
            around = [outer for outer in self._signals[:number] if {*signal.readers} <= {*outer.readers}]
            source = self._through(around, _rerouted(plain, opened))
            found.append(_made(break_path(signal.block, signal.port), producer, source, shape))
        return found

    def rerouted(self, path: str, port: str, source: Wire | Constant) -> Wire | Constant:
        """Return what an input of a block reads."""
        return self._through([signal for signal in self._signals if (path, port) in signal.readers], source)

    @staticmethod
    def _through(signals: Sequence[CutSignal], source: Wire | Constant) -> Wire | Constant:
        """Return a wire from the last break; an index that a part's input has taken is taken no more."""
        if not signals or not isinstance(source, Wire):
            return source
        taken = any(signal.feed is not None and signal.feed.index for signal in signals)
        last = break_path(signals[-1].block, signals[-1].port)
        return replace(source, block=last, port="y", index=() if taken else source.index)


def _break(node: Node, port: str, source: Wire | Constant) -> Node:
    return _made(break_path(node.path, port), node, source, node.shape(port))


def _made(path: str, node: Node, source: Wire | Constant, shape: Shape) -> Node:
    """Return a break that runs with a block."""
    inputs: dict[str, Wire | Constant] = {
        "u": source,
        "added": Constant(np.zeros(shape) if shape else 0.0),
    }
    return Node(path, "break", Break(), node.task, inputs, {"*": shape})
