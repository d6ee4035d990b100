"""Which rows a run records: those that its diagram logs, and those that only a replay needs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from quadvis.diagram.diagram import Diagram
from quadvis.graph.graph import Graph, Node
from quadvis.output.recording import RecordedBlock, RecordedPort, ports
from quadvis.run.outside import outside

FOLDER = "/_replay"  # of the topics that only a replay needs
LEFT_OUT = (RecordedPort("first", "int64"), RecordedPort("count", "int64"))  # ticks that a run left out


class RecordedNode(NamedTuple):
    """A node whose outputs are recorded at its first and then at every ``every`` of its ticks."""

    node: Node
    block: RecordedBlock
    every: int


def signals_of(diagram: Diagram) -> list[RecordedNode]:
    """Return what a diagram logs."""
    return [
        RecordedNode(
            node, RecordedBlock(f"/{node.path}", ports(node), node.task.name), diagram.decimation(node.path)
        )
        for node in diagram.graph.nodes
        if diagram.logs(node.path) and ports(node)
    ]


def inputs_of(diagram: Diagram, graphs: Iterable[Graph]) -> list[RecordedNode]:
    """Return what a log holds besides: blocks that reach outside and whose rows are not all logged.

    ``graphs`` are those that run: the whole in a simulation, in real time each computer's part.
    """
    return [
        RecordedNode(node, RecordedBlock(input_topic(node.path), ports(node), node.task.name, True), 1)
        for graph in graphs
        for node in outside(graph)
        if ports(node) and not all_logged(diagram, node.path)
    ]


def all_logged(diagram: Diagram, path: str) -> bool:
    """Whether a diagram logs a block's outputs at all its ticks."""
    return diagram.logs(path) and diagram.decimation(path) == 1


def input_topic(path: str) -> str:
    """Return the topic of the rows of a block that only a replay needs."""
    return f"{FOLDER}/inputs/{path}"


def left_out(computer: str) -> RecordedBlock:
    """Return the topic of the ticks that a computer has left out in a real-time run: the first, how many."""
    return RecordedBlock("/".join(filter(None, (FOLDER, "left_out", computer))), LEFT_OUT, hidden=True)
