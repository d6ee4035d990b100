"""What the links of a real-time run need: shared words, ends of cables, addresses of this machine."""

from __future__ import annotations

import socket
from collections.abc import Iterator, Mapping, Sequence
from multiprocessing.context import SpawnContext
from typing import Any

from quadvis.block import CABLE
from quadvis.errors import QuadvisError, quoted, sentence
from quadvis.graph.devices import devices
from quadvis.graph.graph import Graph
from quadvis.links.link import MEMORY, SERIAL, Link
from quadvis.machine.serial_port import Line, missing_port
from quadvis.realtime.cables import Cable, Ends

LOCAL = "127.0.0.1"


class Lines:
    """The resources of links, from the ends of their `cables` on.

    ``sending`` and ``receiving`` have what each end of a link is opened with, by the link's name; they are
    complete after `lay`. ``here`` are the computers of this machine.
    """

    def __init__(self, context: SpawnContext, links: Sequence[Link], here: Sequence[str]) -> None:
        self._links, self._here = links, here
        self.sending: dict[str, Any] = {}
        self.receiving: dict[str, Any] = {}
        self._memory = {link.name for link in links if link.via == MEMORY}
        for link in links:
            if link.via == MEMORY:
                words = context.RawArray("q", link.words)
                self.sending[link.name] = self.receiving[link.name] = words

    @property
    def cables(self) -> list[Cable]:
        """The cables to be made: one for each serial link of which an end has no port."""
        return [
            Cable(_cable(link), Line(link.baud))
            for link in self._links
            if link.via == SERIAL and not all(link.ports)
        ]

    def lay(self, ends: Mapping[str, Ends]) -> None:
        """Take the ends of the cables, and choose the addresses that nobody has named."""
        for link in self._links:
            if link.via == SERIAL:
                made = ends.get(_cable(link), Ends("", ""))
                self.sending[link.name] = link.ports[0] or made.a
                self.receiving[link.name] = link.ports[1] or made.b
            elif link.via != MEMORY:
                self.sending[link.name] = self.receiving[link.name] = _address(link.address)

    def shared(self, computer: str) -> dict[str, Any]:
        """Return the words by which one computer opens the ends of its links in memory, before `lay`."""
        return {name: end for name, end in self._of(computer) if name in self._memory}

    def missing(self) -> Iterator[str]:
        """Yield a sentence for each port of a link that is not there."""
        for link in self._links:
            ends = zip((link.source, link.target), link.ports, strict=True)
            for port in dict.fromkeys(port for end, port in ends if port and end in self._here):
                if words := missing_port(port):
                    yield f"link '{link.name}': {words}"

    def of(self, computer: str) -> dict[str, Any]:
        """Return what one computer opens the other ends of its links with."""
        return {name: end for name, end in self._of(computer) if name not in self._memory}

    def _of(self, computer: str) -> Iterator[tuple[str, Any]]:
        for link in self._links:
            if link.source == computer:
                yield link.name, self.sending.get(link.name)
            elif link.target == computer:
                yield link.name, self.receiving.get(link.name)


def check_reach(links: Sequence[Link], here: Sequence[str]) -> None:
    """Raise QuadvisError if a link from or to another machine does not say how it gets there."""
    for link in links:
        if link.source in here and link.target in here:
            continue
        if link.via == MEMORY:
            lack, remedy = "memory is not shared between machines", "write 'via: udp' or 'via: serial'"
        elif link.via == SERIAL and not all(link.ports):
            lack, remedy = "it has no ports", "give it 'port: {from: ..., to: ...}'"
        elif link.via != SERIAL and not link.address:
            lack, remedy = "it has no address", "give it the 'address' at which the receiver listens"
        else:
            continue
        problem = (
            f"link '{link.name}' joins '{link.source}' and '{link.target}', which are two machines: {lack}"
        )
        raise QuadvisError(sentence(problem, remedy))


def check_cables(graph: Graph, here: Sequence[str]) -> None:
    """Raise QuadvisError if a cable joins a device of this machine to one of another machine."""
    ends: dict[str, list[str]] = {}
    for path, device in devices(graph):
        if device.port_given.startswith(CABLE):
            ends.setdefault(device.port_given, []).append(path)
    for port, paths in ends.items():
        mine = [path for path in paths if graph[path].computer in here]
        others = [path for path in paths if path not in mine]
        if mine and others:
            ends_of = f"{quoted(mine[0])} and {quoted(others[0])}, which are on two machines"
            raise QuadvisError(
                sentence(f"the cable '{port}' joins {ends_of}", "give each its port, such as /dev/ttyUSB0")
            )


def _cable(link: Link) -> str:
    return f"link {link.name}"


def _address(written: str) -> tuple[str, int]:
    """Return a host and a port; those of a free place of this machine if none are written."""
    if written:
        host, _, port = written.rpartition(":")
        return host.strip("[]"), int(port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((LOCAL, 0))
        return LOCAL, int(free.getsockname()[1])
