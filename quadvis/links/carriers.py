"""Carriers: how the records of a link travel. Each end is opened once, and never waits after that."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Any, Protocol

from quadvis.errors import QuadvisError, sentence
from quadvis.links.frame import Decoder, encode
from quadvis.links.link import MEMORY, SERIAL, Link
from quadvis.links.serial_line import SerialLine
from quadvis.links.udp import UdpSocket
from quadvis.machine.mailbox import Arrival, Mailbox

WAITING = 4096  # frames that are kept of a sender whose clock is ahead, the newest


class Carrier(Protocol):
    """One end of a link.

    ``notes`` says in words what a user should know of the end, such as what a driver has refused.
    """

    notes: tuple[str, ...]

    @property
    def lost(self) -> int:
        """How many frames did not come whole."""

    @property
    def refused(self) -> int:
        """How many pieces between two ends were no whole frames."""

    def send(self, stamp: int, payload: bytes) -> None:
        """Send a message of an instant (ns)."""

    def receive(self, before: int) -> Arrival | None:
        """Return the newest message that has come and was sent before an instant; None if it is not new."""

    def close(self) -> None:
        """Release the end."""


class ByteLine(Protocol):
    """Something that takes and gives bytes, and never waits."""

    def write(self, data: bytes) -> bool:
        """Hand over a frame; return whether it was taken."""

    def read(self) -> Iterator[bytes]:
        """Yield the bytes that have come."""

    def close(self) -> None:
        """Release the line."""


class MemoryCarrier:
    """A mailbox in memory that both ends share; only the newest message counts, so none is lost."""

    lost = refused = 0
    notes: tuple[str, ...] = ()

    def __init__(self, link: Link, words: Any) -> None:
        self._mailbox = Mailbox(words, link.message.room(link.room), link.records)
        self._name, self._largest = link.name, link.room
        self._seen = -1

    def send(self, stamp: int, payload: bytes) -> None:
        """Leave a message; QuadvisError if its pictures have no room."""
        if len(payload) > self._mailbox.room:
            height, width = self._largest
            problem = (
                f"link '{self._name}' has room for pictures of {height} x {width} px, and these are larger"
            )
            raise QuadvisError(sentence(problem, "declare the link with another 'room'"))
        self._mailbox.put(payload, stamp)

    def receive(self, before: int) -> Arrival | None:
        """Return the newest message from before an instant, if it is new."""
        found = self._mailbox.newest(before, self._seen)
        if found is not None:
            self._seen = found.stamp
        return found

    def close(self) -> None:
        """Leave the memory to whoever has made it."""


class FrameCarrier:
    """Frames on a line of bytes."""

    def __init__(self, link: Link, line: ByteLine, notes: tuple[str, ...] = ()) -> None:
        self._message, self._line, self.notes = link.message, line, notes
        self._decoder = Decoder(link.message)
        self._sequence = 0
        self._waiting: deque[Arrival] = deque(maxlen=WAITING)  # whole, and sent too late for the last tick

    @property
    def lost(self) -> int:
        """How many frames did not come whole."""
        return self._decoder.lost

    @property
    def refused(self) -> int:
        """How many pieces between two ends were no whole frames."""
        return self._decoder.refused

    def send(self, stamp: int, payload: bytes) -> None:
        """Send a frame; one that the line does not take is missed by the receiver."""
        self._line.write(encode(self._message, self._sequence, stamp, payload))
        self._sequence += 1

    def receive(self, before: int) -> Arrival | None:
        """Return the newest whole frame from before an instant, if it is new."""
        for data in self._line.read():
            for arrival in self._decoder.take(data):
                if self._waiting and arrival.stamp <= self._waiting[-1].stamp:
                    self._waiting.clear()  # the sender has begun anew
                self._waiting.append(arrival)
        ready = None
        while self._waiting and self._waiting[0].stamp < before:  # stamps only rise
            ready = self._waiting.popleft()
        return ready

    def close(self) -> None:
        """Close the line."""
        self._line.close()


def open_sender(link: Link, resource: Any) -> Carrier:
    """Open the sending end of a link with its resource, which whoever starts both computers makes.

    memory: `Link.words` words that both ends share, all 0 at the beginning. serial: the path of a port, that
    of `Link.ports` or, where this is "", an end of a pair of ptys paced at `Link.baud`. udp: the address
    (host, port) at which the receiver listens, for both ends. QuadvisError if it cannot be opened.
    """
    return _opened(link, resource, listens=False)


def open_receiver(link: Link, resource: Any) -> Carrier:
    """Open the receiving end of a link likewise."""
    return _opened(link, resource, listens=True)


def _opened(link: Link, resource: Any, *, listens: bool) -> Carrier:
    if link.via == MEMORY:
        return MemoryCarrier(link, resource)
    try:
        return _on_line(link, resource, listens=listens)
    except QuadvisError as error:
        end = "receiver" if listens else "sender"
        raise QuadvisError(f"link '{link.name}', {end}: {error}") from error


def _on_line(link: Link, resource: Any, *, listens: bool) -> Carrier:
    if link.via == SERIAL:
        line = SerialLine(resource, link.baud)
        slow = f"'{resource}' hands bytes on when it likes: its driver knows no low latency"
        is_cable = not link.ports[listens]
        return FrameCarrier(link, line, () if line.low_latency or is_cable else (slow,))
    return FrameCarrier(link, UdpSocket(resource, listens=listens))
