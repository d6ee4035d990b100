"""Datagrams from one computer to another: sent and taken without ever waiting."""

from __future__ import annotations

import socket
from collections.abc import Iterator

from quadvis.errors import QuadvisError
from quadvis.machine.files import reason

MOST = 256  # datagrams at one reading: a flood must not hold up a loop
LARGEST = 1 << 16

Address = tuple[str, int]


class UdpSocket:
    """A socket that sends to an address, or with ``listens`` takes what is sent there.

    QuadvisError if the address cannot be found or is in use.
    """

    def __init__(self, address: Address, *, listens: bool) -> None:
        host, port = address
        try:
            family, kind, number, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind, number)
        except OSError as error:
            raise QuadvisError(f"cannot find '{host}:{port}': {reason(error)}") from error
        self._socket.setblocking(False)
        try:
            (self._socket.bind if listens else self._socket.connect)(place)
        except OSError as error:
            self._socket.close()
            what = "listen at" if listens else "send to"
            raise QuadvisError(f"cannot {what} '{host}:{port}': {reason(error)}") from error

    @property
    def address(self) -> Address:
        """Where it listens."""
        host, port = self._socket.getsockname()[:2]
        return str(host), int(port)

    def write(self, data: bytes) -> bool:
        """Send a datagram; return False if the system does not take it now."""
        for _ in range(2):
            try:
                self._socket.send(data)
            except ConnectionRefusedError:  # an earlier one found nobody; this one was not sent
                continue
            except OSError:  # no room, or no route
                return False
            return True
        return False

    def read(self) -> Iterator[bytes]:
        """Yield the datagrams that have come, at most 256 of them."""
        for _ in range(MOST):
            try:
                yield self._socket.recv(LARGEST)
            except OSError:
                return

    def close(self) -> None:
        """Give the address back."""
        self._socket.close()
