"""Ports that several devices have together: opened once by the guardian, and read by an application.

What outlets send there is put one after another, never into each other. The application that reads has the
guardian's own descriptor: a locked line cannot be opened twice, and answers to datagrams come to the socket
that has sent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle, send_handle
from typing import Protocol, cast

from quadvis.machine.datagrams import LentDatagrams
from quadvis.machine.ports import OpenPort, PortError, PortSettings
from quadvis.machine.serial_port import LentLine, Line
from quadvis.realtime.outlet import OutputPort

ROOM = 512  # bytes that may wait for the line before an outlet leaves a frame out
LENT = 10.0  # s in which an application has got the port


class _Descriptor(Protocol):
    def fileno(self) -> int: ...


class SharedPort(OpenPort):
    """A port of several outlets: it is open as long as one of them has it open."""

    def __init__(self, settings: PortSettings, path: str) -> None:
        self._settings, self._path = settings, path
        self._opened: OpenPort | None = None
        self._users = 0
        self._rest = b""  # of what the port has taken in part

    def open(self) -> OpenPort:
        """Open the port for one more outlet; PortError if it cannot be opened."""
        if self._opened is None:
            self._opened = self._settings.open(self._path)
        self._users += 1
        return self

    @property
    def descriptor(self) -> int | None:
        """The descriptor of the port; None if it is not open."""
        return None if self._opened is None else cast(_Descriptor, self._opened).fileno()

    def write(self, piece: bytes) -> int:
        """Take all bytes; those for which the port has no room go before the next ones."""
        self._rest += piece
        self._flush()
        return len(piece)

    def unsent(self) -> int:
        """Return how many bytes wait, if these are too many for another frame; else 0."""
        self._flush()
        assert self._opened is not None
        waiting = len(self._rest) + self._opened.unsent()
        return waiting if waiting > ROOM else 0

    def close(self) -> None:
        """Close the port, if no other outlet has it."""
        self._users -= 1
        if self._users <= 0 and self._opened is not None:
            with suppress(PortError):
                self._flush()
            self._opened.close()
            self._opened = None

    def _flush(self) -> None:
        assert self._opened is not None
        if self._rest:
            self._rest = self._rest[self._opened.write(self._rest) :]


class SharedPorts:
    """The shared ports of a guardian, by path, each with the sealer of its first outlet."""

    def __init__(self) -> None:
        self._first: dict[str, OutputPort] = {}
        self._ports: dict[str, SharedPort] = {}

    def taken(self, port: OutputPort) -> tuple[OutputPort, Callable[[], OpenPort] | None]:
        """Return the port of an outlet, and what opens it: None if its settings do.

        A shared port has one sealer.
        """
        if not port.shared:
            return port, None
        first = self._first.setdefault(port.path, port)
        made = self._ports.setdefault(port.path, SharedPort(port.settings, port.path))
        return replace(port, sealer=first.sealer), made.open

    def lend(self, readers: Mapping[str, Connection]) -> None:
        """Give each reader the descriptor of its port, by path."""
        for path, reader in readers.items():
            shared = self._ports.get(path)
            if shared is not None and shared.descriptor is not None:
                with suppress(OSError):  # the application has ended
                    send_handle(reader, shared.descriptor, None)


def lent_port(settings: PortSettings, reader: Connection) -> OpenPort:
    """Return a port that the guardian has opened and lent; PortError if it does not come."""
    if not reader.poll(LENT):
        raise PortError("the guardian has not lent the port")
    descriptor = recv_handle(reader)
    return LentLine(descriptor) if isinstance(settings, Line) else LentDatagrams(descriptor)
