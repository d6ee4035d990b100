"""Ports of datagrams: ``udp:HOST:PORT``, sent and taken without ever waiting; one frame is one datagram."""

from __future__ import annotations

import errno
import re
import struct
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from quadvis.errors import quoted, sentence
from quadvis.machine.files import reason
from quadvis.machine.ports import OpenPort, PortError, Waiting

if TYPE_CHECKING:  # few programs have ports of datagrams, and all load this module
    import socket

UDP = "udp:"
FORM = re.compile(r"udp:(?P<host>[\w.-]*|\[[\w:.%]+\]):(?P<number>[0-9]{1,5})")
HERE = "127.0.0.1"
EVERYWHERE = ("0.0.0.0", "::")  # addresses at which one listens, and to which nobody sends
MOST = 1024  # datagrams at one reading: a flood must not hold up a loop
LARGEST = 1 << 16
# <linux/sock_diag.h>: 32-bit words about a socket; one counts the datagrams for which there was no room.
SO_MEMINFO, MEMINFO, DROPS = 55, struct.Struct("9I"), 8


class Address(NamedTuple):
    """A place of datagrams: ``host`` is "" where none was written."""

    host: str
    number: int

    @staticmethod
    def of(port: str) -> Address | None:
        """Return the place of a port such as udp:192.168.0.5:14550; None if it is none."""
        form = FORM.fullmatch(port)
        if form is None or not 0 < int(form["number"]) < 1 << 16:
            return None
        return Address(form["host"].strip("[]"), int(form["number"]))


class Datagrams(NamedTuple):
    """Settings of a port of datagrams: where it listens, or if it ``sends``, where frames go.

    Without a host it listens on this computer alone; ``udp:0.0.0.0:PORT`` hears all others, too. A sender
    without a host, or with 0.0.0.0, listens as well, and sends to whoever is first to speak.
    """

    sends: bool
    gap: float = 0.0
    settle: float = 0.0

    def time(self, count: int) -> float:
        """Return 0: the system takes a datagram at once."""
        return 0.0

    def open(self, port: str) -> OpenPort:
        """Open a socket; PortError in one sentence if that cannot be."""
        import socket

        address, listens = self._place(port)
        try:
            family, kind, protocol, _, place = socket.getaddrinfo(*address, type=socket.SOCK_DGRAM)[0]
            opened = socket.socket(family, kind, protocol)
        except OSError as error:
            raise PortError(f"{quoted(port)} cannot be found: {reason(error)}") from error
        try:
            opened.setblocking(False)
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            (opened.bind if listens else opened.connect)(place)
        except OSError as error:
            opened.close()
            what = "listen at" if listens else "send to"
            raise PortError(f"cannot {what} {quoted(port)}: {reason(error)}") from error
        return OpenDatagrams(opened)

    def missing(self, port: str) -> str:
        """Return "": only who opens it finds out."""
        return ""

    def claims(self, port: str) -> Iterable[object]:
        """Return the place at which it listens, or to which it sends."""
        return [(UDP, self._place(port))]

    def __str__(self) -> str:
        """Return what they are."""
        return "datagrams"

    def _place(self, port: str) -> tuple[Address, bool]:
        """Return the place of a port, and whether one listens there."""
        address = Address.of(port)
        if address is None:
            raise PortError(sentence(f"{quoted(port)} is no address", "write such as udp:192.168.0.5:14550"))
        listens = not self.sends or address.host in ("", *EVERYWHERE)
        return address._replace(host=address.host or HERE), listens


class OpenDatagrams(OpenPort):
    """A socket of datagrams."""

    def __init__(self, opened: socket.socket) -> None:
        self.socket = opened
        self._dropped = self._drops()

    def fileno(self) -> int:
        """Return its descriptor."""
        return self.socket.fileno()

    def write(self, piece: bytes) -> int:
        """Send a datagram; 0 if the system does not take it now. One that nobody hears is sent."""
        for _ in range(2):
            try:
                return self.socket.send(piece)
            except ConnectionRefusedError:  # an earlier one found nobody; this one was not sent
                continue
            except OSError as error:
                if error.errno != errno.EDESTADDRREQ:  # no room, or no route
                    return 0
                if not self._answer():
                    break
        return len(piece)

    def read_waiting(self) -> Waiting:
        """Return the datagrams that have come."""
        drops = self._drops()
        found: list[bytes] = []
        while len(found) < MOST:
            try:
                found.append(self.socket.recv(LARGEST))
            except ConnectionRefusedError:
                continue
            except OSError:
                break
        late = drops != self._dropped or len(found) == MOST
        self._dropped = drops
        return Waiting(tuple(found), late)

    def close(self) -> None:
        """Give the address back."""
        self.socket.close()

    def _answer(self) -> bool:
        """Make the first who has spoken the one to whom frames go; return whether anybody has."""
        import socket

        try:
            address: Any = self.socket.recvfrom(1, socket.MSG_PEEK)[1]
            self.socket.connect(address)
        except OSError:
            return False
        return True

    def _drops(self) -> int:
        import socket

        try:
            words = self.socket.getsockopt(socket.SOL_SOCKET, SO_MEMINFO, MEMINFO.size)
        except OSError:  # other systems than Linux
            return 0
        return int(MEMINFO.unpack(words)[DROPS])


class LentDatagrams(OpenDatagrams):
    """A socket that another process has opened and sends with; this one reads.

    Both have one socket, so what is read here is no longer there for the other process to look at: whoever is
    first to speak is made the one to whom frames go here.
    """

    def __init__(self, descriptor: int) -> None:
        import socket

        super().__init__(socket.socket(fileno=descriptor))

    def read_waiting(self) -> Waiting:
        """Return the datagrams that have come."""
        try:
            self.socket.getpeername()
        except OSError:
            self._answer()
        return super().read_waiting()
