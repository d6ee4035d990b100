"""How old a stamp becomes on its way, by the rates and links alone: what `quadvis check` says of an age."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from quadvis.analysis.loops import AnalysisError, hyperperiod
from quadvis.diagram.diagram import Diagram
from quadvis.engine.engine import Engine
from quadvis.graph.graph import Constant, Graph, Node, Wire
from quadvis.links.insertion import sender_path
from quadvis.links.stamps import AGE, HOLDER, METER, STAMP, PresentStamp
from quadvis.links.twin import ReceiverTwin, SenderTwin

NOW = "now"


class WorstAge(NamedTuple):
    """An age that a diagram expects: in words, the greatest one (s), and the limit."""

    text: str
    greatest: float
    limit: float

    def __str__(self) -> str:
        found, limit = (f"{1e3 * time:.4g} ms" for time in (self.greatest, self.limit))
        return f"{self.text}: at most {found} from the tick at which the stamp is given (limit {limit})"


def worst_ages(diagram: Diagram) -> list[WorstAge]:
    """Return the ages that a diagram expects, as far as its rates fit into each other."""
    found = []
    for expectation in diagram.expectations:
        path = expectation.selection.name.removesuffix(f".{AGE}")
        if path in {node.path for node in diagram.graph.nodes} and diagram.graph[path].origin == METER:
            try:
                greatest = worst_age(diagram.graph, path)
            except AnalysisError:
                continue
            found.append(WorstAge(expectation.selection.text, greatest, expectation.limit))
    return found


def worst_age(graph: Graph, meter: str) -> float:
    """Return the greatest age at a meter (s), if the stamp is the time of the tick at which it is given.

    Nothing is lost, and every frame has its greatest jitter. The nodes that carry the stamp run in an engine
    until their rhythm repeats. AnalysisError if this takes too long.
    """
    parts = {node.path: node for node in _way(graph, meter)}
    nodes = [parts[node.path] for node in graph.nodes if node.path in parts]
    step = graph.step if any(node.task.continuous for node in nodes) else None
    alone = Graph(graph.name, nodes, graph.solver, step, graph.tasking, graph.tolerances)
    span = hyperperiod(alone, alone.tasks)
    senders = [node.block for node in nodes if isinstance(node.block, SenderTwin)]
    longest = sum(float(node.task.period) for node in nodes) + sum(sender.latency for sender in senders)
    offset = max(float(task.offset) for task in alone.tasks)
    settled = math.ceil((offset + longest) / float(span * alone.tick)) + 1
    ages: list[float] = []
    engine = Engine(alone)
    with engine:
        engine.run(settled * span)
        engine.observe(alone[meter].task.name, lambda _: ages.append(engine.read(meter, AGE)))
        engine.run(span)
    return max(ages)


def _way(graph: Graph, meter: str) -> Iterator[Node]:
    """Yield the nodes that carry the stamp, from a clock in the place of its block to the meter."""
    node, port = graph[meter], STAMP
    while True:
        wire = node.inputs[port]
        assert isinstance(wire, Wire)
        source = graph[wire.block]
        if isinstance(source.block, ReceiverTwin):
            yield node
            yield source
            node, port = _sender(graph[sender_path(wire.block)], wire.port), wire.port
        elif source.origin == HOLDER:
            yield node
            node, port = source, STAMP
        else:
            yield replace(node, inputs={**node.inputs, port: replace(wire, port=NOW, index=())})
            yield replace(source, kind="clock", block=PresentStamp(), inputs={}, sizes={})
            return


def _sender(node: Node, stamp: str) -> Node:
    """Return a sender that carries one signal, loses nothing, and has its greatest delay each time."""
    twin = node.block
    assert isinstance(twin, SenderTwin)
    slow = type(twin)(latency=twin.latency + twin.jitter, jitter=0.0, loss=0.0, spoils=0.0)
    still = {signal.name: Constant(signal.initial) for signal in twin.link.message.signals}
    return replace(node, block=slow, inputs={**still, stamp: node.inputs[stamp]})
