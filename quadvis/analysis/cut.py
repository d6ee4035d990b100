"""The signals at which an analysis opens a graph: each passes a block that adds a disturbance.

The signal of an output passes it on the way to all readers, that of an input on the way to its block alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out
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


def with_breaks(graph: Graph, signals: Iterable[tuple[str, str]]) -> Graph:
    """Return the graph with a break at each of the ports (block, port), otherwise unchanged."""
    opened = set(signals)
    nodes = []
    for node in graph.nodes:
        inputs = {name: _rerouted(source, opened) for name, source in node.inputs.items()}
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


def _break(node: Node, port: str, source: Wire | Constant) -> Node:
    shape = node.shape(port)
    inputs: dict[str, Wire | Constant] = {
        "u": source,
        "added": Constant(np.zeros(shape) if shape else 0.0),
    }
    return Node(break_path(node.path, port), "break", Break(), node.task, inputs, {"*": shape})
