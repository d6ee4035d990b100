"""Ports: what a device reaches, of whichever kind: a serial line, datagrams, or the driver of a card.

The settings of a port say how it is opened, and can be sent to the process that opens it. What is open then
never waits.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Protocol

from quadvis.errors import QuadvisError


class PortError(QuadvisError):
    """A port that cannot be opened, read or written."""


class ChannelError(PortError):
    """Some channels of a port have refused what was written; all others have it."""


class Waiting(NamedTuple):
    """What has come: pieces in their order.

    ``late`` says that the system had no room for more, so that nobody knows how old they are. ``skipped`` is
    the number of pieces that newer ones have replaced, ``age`` (s) is that of the newest one, if it is known.
    """

    pieces: tuple[bytes, ...] = ()
    late: bool = False
    skipped: int = 0
    age: float = 0.0


class OpenPort:
    """A port that is open. A subclass overrides what its port can do.

    ``whole`` says that each piece that is read holds whole messages: what is left of one belongs to no other.
    """

    whole = True

    def write(self, piece: bytes) -> int:
        """Write as many bytes as there is room for; return their number. PortError if the port is gone."""
        raise NotImplementedError

    def unsent(self) -> int:
        """Return how many bytes have been written and not been sent yet."""
        return 0

    def read_waiting(self) -> Waiting:
        """Return what has come; PortError if the port is gone."""
        return Waiting()

    def close(self) -> None:
        """Release the port."""
        raise NotImplementedError


class PortSettings(Protocol):
    """How a port is opened; ``port`` is the text that a diagram has for it."""

    @property
    def gap(self) -> float:
        """The silence (s) that a receiver needs after a frame."""

    @property
    def settle(self) -> float:
        """The time (s) in which a device starts: it hears nothing, and says nothing that counts."""

    def time(self, count: int) -> float:
        """Return how long so many bytes take (s)."""

    def open(self, port: str) -> OpenPort:
        """Open the port; PortError in one sentence if that cannot be."""

    def missing(self, port: str) -> str:
        """Return a sentence if the port is surely not there, else ""."""

    def claims(self, port: str) -> Iterable[object]:
        """Return what no two devices may have, as keys."""


class Card:
    """Settings of a port that is a driver of a card: base class, whose subclasses have ``open``.

    They can be sent to another process (dataclasses, for example). The driver is imported in ``open``. What
    this returns takes a whole frame in one ``write``, channel by channel: a channel that refuses its value
    keeps no other from its own, and ChannelError comes after the last one.
    """

    gap = 0.0
    settle = 0.0

    def time(self, count: int) -> float:
        """Return 0: a driver takes a frame at once."""
        return 0.0

    def open(self, port: str) -> OpenPort:
        """Open the port; PortError in one sentence if that cannot be."""
        raise NotImplementedError

    def missing(self, port: str) -> str:
        """Return "": who opens the port finds it."""
        return ""

    def claims(self, port: str) -> Iterable[object]:
        """Return the port itself; a card with channels returns these."""
        return [port]
