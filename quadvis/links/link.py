"""Links: what carries the wires from one computer to another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from quadvis.links.frame import longest
from quadvis.links.message import Message
from quadvis.machine.mailbox import Mailbox

MEMORY, SERIAL, UDP = CARRIERS = ("memory", "serial", "udp")
BITS = 10  # of a byte on a serial line: a start bit, eight data bits, a stop bit
PICTURE = (1080, 1920)  # px, height and width of the largest picture that has room without a `room`


@dataclass(frozen=True, eq=False)
class Link:
    """What carries signals of one task of one computer to another computer.

    ``period`` is that of the sender's task, ``read_period`` that of the receiver's (s). ``jitter`` (s),
    ``loss`` (share of frames) and ``flips`` (share of bits) hold in a simulation alone. ``ports`` are the
    serial ports of sender and receiver, "" for the ends of a cable. ``address`` is where the receiver
    listens, "" for any free place of this machine. ``declared`` is False if no diagram names the link.
    """

    name: str
    source: str
    target: str
    via: str
    task: str
    period: Fraction
    read_period: Fraction
    message: Message
    baud: int = 0
    jitter: float = 0.0
    loss: float = 0.0
    flips: float = 0.0
    ports: tuple[str, str] = ("", "")
    address: str = ""
    room: tuple[int, int] = PICTURE
    declared: bool = True

    @property
    def bytes(self) -> int:
        """Length of a frame on a line, or of a record in memory without its pixels."""
        return self.message.size if self.via == MEMORY else longest(self.message)

    @property
    def latency(self) -> float:
        """Time (s) that a frame takes on a line."""
        return self.bytes * BITS / self.baud if self.baud else 0.0

    @property
    def share(self) -> float:
        """The part of the line's time that its frames take; 0 for other carriers."""
        return self.latency / float(self.period)

    @property
    def spoilt(self) -> float:
        """The share of frames in which a bit is flipped."""
        return -math.expm1(8 * self.bytes * math.log1p(-self.flips)) if self.flips < 1.0 else 1.0

    @property
    def words(self) -> int:
        """The words of 8 bytes that both ends share; 0 for other carriers than memory."""
        return Mailbox.size(self.message.room(self.room), self.records) if self.via == MEMORY else 0

    @property
    def records(self) -> int:
        """The number of records in memory: those of one period of the reader, and some to be late."""
        return min(math.ceil(self.read_period / self.period), 60) + 4

    def facts(self) -> str:
        """Return its load in words."""
        rate = f"{float(1 / self.period):g} a second"
        if self.via == MEMORY:
            pictures = " and pictures" if self.message.has_pictures else ""
            return f"{self.bytes} bytes{pictures} in memory, {rate}"
        found = f"{self.bytes} bytes a frame, {rate}"
        return f"{found}: {100 * self.share:.3g} % of {self.baud} baud" if self.baud else f"{found}, over UDP"
