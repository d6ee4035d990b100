"""Which rows a run records: those that its diagram logs, and those that only a replay needs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from quadvis.diagram.diagram import Diagram
from quadvis.graph.graph import Graph, Node
from quadvis.output.recording import TASK_TIMES, RecordedBlock, RecordedPort, ports
from quadvis.run.outside import outside

FOLDER = "/_replay"  # of the topics that only a replay needs
LEFT_OUT = (RecordedPort("first", "int64"), RecordedPort("count", "int64"))  # ticks that a run left out
# What a task that runs by itself missed: its number, a tick at which it was due, how many times from then on
# it did not begin; the tick at which it began late after these, or -1.
RELEASES = tuple(RecordedPort(name, "int64") for name in ("task", "tick", "count", "late"))
# The lateness and the execution time of a task's step, and how many overruns the task had until its end.
TIMES = (
    RecordedPort("lateness", unit="s"), RecordedPort("tet", unit="s"), RecordedPort("overruns", "int64"),
)  # fmt: skip


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
        for node in diagram.graph_here.nodes
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
    return RecordedBlock(_topic(FOLDER, "left_out", computer), LEFT_OUT, hidden=True)


def releases(computer: str) -> RecordedBlock:
    """Return the topic of what tasks that run by themselves missed on a computer."""
    return RecordedBlock(_topic(FOLDER, "releases", computer), RELEASES, hidden=True)


def times_of(computer: str, task: str) -> RecordedBlock:
    """Return the topic of the times of a task, at each tick at which it ran."""
    return RecordedBlock(_topic(f"/{TASK_TIMES}", computer, task), TIMES, task, hidden=True)


def _topic(*names: str) -> str:
    return "/".join(filter(None, names))
