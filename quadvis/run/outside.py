"""Blocks that reach outside: the memory of a run does not determine their outputs, so a replay plays them.

Such a block reads or writes the world, or says that it is not replayable. A block that reads only files is
none: a replay reads the same files again. A log holds no frames, so a block that takes frames from such a
block counts as one, too.
"""

from __future__ import annotations

from collections.abc import Iterator

from quadvis.block import Block
from quadvis.graph.graph import Graph, Node


def outside(graph: Graph) -> list[Node]:
    """Return the nodes of a graph that reach outside, in the order of execution."""
    found = {node.path for node in graph.nodes if _reaches_outside(node.block)}
    new = found
    while new:
        new = {node.path for node in graph.nodes if not new.isdisjoint(_cameras(node, graph))} - found
        found |= new
    return [node for node in graph.nodes if node.path in found]


def _reaches_outside(block: Block) -> bool:
    methods = block.interface.arguments
    reads = "read" in methods and not block.interface.files_read
    return bool(block.not_replayable) or "write" in methods or reads


def _cameras(node: Node, graph: Graph) -> Iterator[str]:
    """Yield the blocks whose frames a node takes."""
    for _, wire in node.wires():
        if (
            wire.block in graph
            and graph[wire.block].block.interface.outputs[wire.port].signal.scalar == "frame"
        ):
            yield wire.block
