"""The ends of links in an application: blocks that send and receive, in the place of the twins.

    part = graph.part_of(computer)
    carriers = open_carriers(part, resources)      # what `open_sender` asks for, by link
    engine = Engine(live(part, carriers), ...)
    ...
    for carrier in carriers.values(): carrier.close()

An end has the path, the task and the outputs of its twin, so that logs and verdicts are the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from quadvis.block import Block, In, Out
from quadvis.graph.graph import Graph, Node
from quadvis.links.carriers import Carrier, open_receiver, open_sender
from quadvis.links.link import Link
from quadvis.links.twin import ReceiverTwin, SenderTwin, count_ports
from quadvis.links.twin_code import nanoseconds


def links_of(graph: Graph) -> list[Link]:
    """Return the links of which an end is in a graph, in the order of their names."""
    ends = (node.block for node in graph.nodes)
    found = {end.link.name: end.link for end in ends if isinstance(end, SenderTwin | ReceiverTwin)}
    return [found[name] for name in sorted(found)]


def open_carriers(part: Graph, resources: Mapping[str, Any]) -> dict[str, Carrier]:
    """Open the ends of the links in one computer's part of a graph; none stays open if one cannot be.

    ``resources`` has for each of `links_of` what `open_sender` asks for.
    """
    found: dict[str, Carrier] = {}
    try:
        for node in part.nodes:
            end = node.block
            if isinstance(end, SenderTwin):
                found[end.link.name] = open_sender(end.link, resources[end.link.name])
            elif isinstance(end, ReceiverTwin):
                found[end.link.name] = open_receiver(end.link, resources[end.link.name])
    except BaseException:
        close_all(found.values())
        raise
    return found


def close_all(carriers: Iterable[Carrier]) -> None:
    """Close the ends of links."""
    for carrier in carriers:
        carrier.close()


def live(part: Graph, carriers: Mapping[str, Carrier]) -> Graph:
    """Return one computer's part of a graph with live ends of links in the place of the twins."""
    return replace(part, nodes=[_live(node, carriers) for node in part.nodes])


def live_parts(graph: Graph) -> dict[str, Graph]:
    """Return what each computer runs in real time, by its name, to be looked at: no link is open."""
    return {computer: live(graph.part_of(computer), {}) for computer in graph.computers}


def _live(node: Node, carriers: Mapping[str, Carrier]) -> Node:
    twin = node.block
    if isinstance(twin, SenderTwin):
        signals = {signal.name for signal in twin.link.message.signals}
        wires = {port: wire for port, wire in node.inputs.items() if port in signals}
        return replace(node, block=_sender(twin.link, carriers.get(twin.link.name))(), inputs=wires)
    if isinstance(twin, ReceiverTwin):
        return replace(node, block=_receiver(twin.link, carriers.get(twin.link.name))(), inputs={})
    return node


class LinkSender(Block, numeric=False):
    """Sends one message at each of its ticks."""

    harmless = "whoever receives nothing sees it by the age"
    link: Link
    carrier: Carrier

    def send(self, values: tuple[Any, ...], time: float) -> None:
        """Send the values of all signals."""
        self.carrier.send(nanoseconds(time), self.link.message.pack(values))


class LinkReceiver(Block, numeric=False):
    """Takes all that has come and gives the newest whole message that was sent before this instant."""

    not_replayable = "it hears another computer"
    link: Link
    carrier: Carrier

    def open(self) -> None:
        """Begin with the values that hold before the first message."""
        self._values = tuple(signal.initial for signal in self.link.message.signals)
        self._stamp = 0

    def read(self, time: float) -> None:
        """Take what has come."""
        found = self.carrier.receive(nanoseconds(time))
        if found is not None:
            self._values, self._stamp = self.link.message.unpack(found.payload), found.stamp

    def output(self, time: float) -> Any:
        """Return the signals, the age of the message, and the counts of frames."""
        return (*self._values, time - self._stamp * 1e-9, self.carrier.lost, self.carrier.refused)


def _sender(link: Link, carrier: Carrier | None) -> type[LinkSender]:
    """Return the class of a link's sender; a method must name its inputs, so it is made of them."""
    names = [signal.name for signal in link.message.signals]
    namespace: dict[str, Any] = {}
    exec(
        f"def write(self, {', '.join(names)}, time):\n    self.send(({', '.join(names)},), time)\n", namespace
    )
    ports = {signal.name: In(signal.type) for signal in link.message.signals}
    members = {**ports, "write": namespace["write"], "link": link, "carrier": carrier, "__module__": __name__}
    return type("LinkSender", (LinkSender,), members, numeric=False)


def _receiver(link: Link, carrier: Carrier | None) -> type[LinkReceiver]:
    ports = {signal.name: Out(signal.type, nan=signal.nan) for signal in link.message.signals}
    members = {**ports, **count_ports(), "link": link, "carrier": carrier, "__module__": __name__}
    return type("LinkReceiver", (LinkReceiver,), members, numeric=False)
