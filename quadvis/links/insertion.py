"""Links put into the nodes of a checked diagram: a sender and a receiver in the place of wires."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from quadvis.graph.graph import Node, Task, Wire, rank
from quadvis.links.link import Link
from quadvis.links.message import MessageSignal
from quadvis.links.twin import ReceiverTwin, is_taken, receiver_twin, rings, sender_twin
from quadvis.units import Unit

RECEIVER, SENDER = "link", "sender of a link"  # the origins of nodes
ONE, SECOND = Unit(), Unit.parse("s")

Input = tuple[str, str]  # a block and an input
Output = tuple[str, str]  # a block and an output


class Written(NamedTuple):
    """A wire that a link carries, as a diagram writes it: its source, and the signal in the message."""

    wire: Wire
    link: Link
    signal: MessageSignal


def sender_path(link: str) -> str:
    """Return the path of a link's sender."""
    return f"{link}/sender"


def receivers_first(nodes: Iterable[Node]) -> list[Node]:
    """Return nodes with the ends of links by their names, the receivers before all blocks.

    So their places in the order of execution do not depend on the wires that are read first.
    """
    return sorted(nodes, key=_place)


def _place(node: Node) -> tuple[int, str]:
    places = {RECEIVER: 0, SENDER: 2}
    return places.get(node.origin, 1), node.path if node.origin in places else ""


def fastest(tasks: Iterable[Task]) -> Task:
    """Return the task in which a receiver runs, of those of its readers."""
    return min(tasks, key=rank)


def signal_names(sources: Sequence[Output]) -> list[str]:
    """Return a name in a message for each output: that of its port, unless another one has it."""
    ports = [port for _, port in sources]
    found: list[str] = []
    for number, (block, port) in enumerate(sources):
        long = f"{block.replace('/', '_')}_{port}"
        choice = (*([port] if ports.count(port) == 1 else ()), long, f"signal_{number}", f"signal_{number}_")
        found.append(next(name for name in choice if not is_taken(name) and name not in found))
    return found


def insert(nodes: dict[str, Node], link: Link, readers: Iterable[Input]) -> None:
    """Add the two ends of a link to the nodes, and let the readers' inputs come from its receiver."""
    readers = list(readers)
    signals = {(signal.block, signal.port): signal for signal in link.message.signals}
    producer = nodes[link.message.signals[0].block]
    sender = Node(
        sender_path(link.name), f"link {link.via}", sender_twin(link), producer.task,
        {signal.name: Wire(signal.block, signal.port) for signal in signals.values()},
        computer=link.source, origin=SENDER, hidden=True,
    )  # fmt: skip
    sender.units = _units(sender, {})
    receiver = Node(
        link.name, f"link {link.via}", receiver_twin(link), fastest(nodes[path].task for path, _ in readers),
        {port: Wire(sender.path, ring, earlier=True) for port, ring in rings(link).items()},
        computer=link.target, origin=RECEIVER,
    )  # fmt: skip
    receiver.units = _units(receiver, {signal.name: signal.units for signal in signals.values()})
    nodes[sender.path], nodes[receiver.path] = sender, receiver
    for path, port in readers:
        wire = nodes[path].inputs[port]
        assert isinstance(wire, Wire)
        signal = signals[wire.block, wire.port]
        nodes[path].inputs[port] = replace(wire, block=link.name, port=signal.name)


def _units(node: Node, known: Mapping[str, tuple[Unit, ...]]) -> dict[str, tuple[Unit, ...]]:
    """Return the units of a node's outputs: those of the signals, and those that the class declares."""
    outputs = node.block.interface.outputs
    return {name: known.get(name) or port.units for name, port in outputs.items()}


def written(nodes: Mapping[str, Node], wire: Wire) -> Written | None:
    """Return what a diagram writes for a wire from a link's receiver; None for any other wire."""
    twin = nodes[wire.block].block if wire.block in nodes else None
    if not isinstance(twin, ReceiverTwin):
        return None
    signal = next(signal for signal in twin.link.message.signals if signal.name == wire.port)
    return Written(replace(wire, block=signal.block, port=signal.port), twin.link, signal)
