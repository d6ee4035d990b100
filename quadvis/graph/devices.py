"""The devices of a graph: blocks that reach ports, which only a real-time run may."""

from __future__ import annotations

from collections.abc import Iterator

from quadvis.block import Device
from quadvis.errors import QuadvisError, sentence
from quadvis.graph.graph import Graph


def devices(graph: Graph) -> Iterator[tuple[str, Device]]:
    """Yield the devices by path."""
    for node in graph.nodes:
        if isinstance(node.block, Device):
            yield node.path, node.block


def refuse_devices(graph: Graph, remedy: str = "choose a variant without devices") -> None:
    """Refuse to simulate a graph with a device: no port may see times that are not the clock's."""
    for path, device in devices(graph):
        problem = f"block '{path}' reaches port '{device.port_given}', and only a real-time run may do so"
        raise QuadvisError(sentence(problem, remedy))
