"""One ROUTER socket in the porter: it bounds who is connected, and gives each message with its sender.

ZeroMQ itself accepts any number of TCP connections that never show a key, each of which is a descriptor of
this process. Its monitor tells of each; beyond a number we shut the oldest of those that are too young to
be cut off by ZeroMQ. The address from which a key was let in of late is spared if there is another one.
"""

from __future__ import annotations

import os
import socket
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import zmq

from quadvis.wire.limits import (
    CONNECTIONS,
    DEAD_AFTER,
    HALF_OPEN,
    HANDSHAKE,
    HANDSHAKES,
    HEARTBEAT,
    QUEUED,
    REQUEST,
)  # fmt: skip
from quadvis.wire.monitor import next_event
from quadvis.wire.outbox import Outbox

_EVENTS = zmq.Event.ACCEPTED | zmq.Event.DISCONNECTED
_RECEIVED = 2  # messages of one connection that libzmq holds for us
_OURS = 5  # bytes of an identity that libzmq made, which begins with a zero


class Letter(NamedTuple):
    """A message with what the transport says of its sender; ``data`` is None if it has a wrong form."""

    identity: bytes
    user: str
    address: str
    data: bytes | None


@dataclass
class _Connection:
    since: float
    address: str
    shut: bool = False


class Entrance:
    """A ROUTER socket at a port (a number) or a path.

    ``keys`` are the target's, public and private, for CURVE; None for its absence on this computer.
    """

    def __init__(
        self, context: zmq.Context[Any], domain: str, place: int | str, keys: tuple[bytes, bytes] | None
    ) -> None:
        self.place = place
        self.socket = made = context.socket(zmq.ROUTER)
        made.linger = 0
        made.router_mandatory = True
        made.rcvhwm, made.sndhwm = _RECEIVED, QUEUED
        made.maxmsgsize = REQUEST  # whoever announces more is cut off before it takes memory
        made.handshake_ivl = int(HANDSHAKE * 1000)
        made.heartbeat_ivl, made.heartbeat_timeout = int(HEARTBEAT * 1000), int(DEAD_AFTER * 1000)
        made.zap_domain = domain.encode()
        if keys is not None:
            made.curve_server = True
            made.curve_publickey, made.curve_secretkey = keys
        self.monitor = made.get_monitor_socket(_EVENTS)
        self.outbox = Outbox(made)
        self.connected = 0
        self.shut = 0  # connections that were too many
        self._open: dict[int, _Connection] = {}  # by descriptor, as the monitor tells
        self._let_in: deque[tuple[float, str, str]] = deque()  # when which key, from where, of late

    def open(self, descriptor: int, ipv6: bool) -> None:
        """Accept connections at a socket that listens already."""
        self.socket.ipv6 = ipv6
        self.socket.setsockopt(zmq.USE_FD, descriptor)
        # The address is not used; its kind is.
        self.socket.bind(
            f"ipc://{self.place}" if isinstance(self.place, str) else f"tcp://127.0.0.1:{self.place}"
        )

    def count(self) -> None:
        """Note who came and went, and shut who is too many."""
        while self.monitor.poll(0):
            event, descriptor = next_event(self.monitor)
            if event == zmq.Event.ACCEPTED:
                self._open[descriptor] = _Connection(time.monotonic(), self._peer(descriptor))
            else:
                self._open.pop(descriptor, None)
        if isinstance(self.place, int):
            self._bound()
        self.connected = len(self._open)

    def _bound(self) -> None:
        """Shut the connections that are too many."""
        young = time.monotonic() - HANDSHAKE
        excess = sum(not each.shut for each in self._open.values()) - CONNECTIONS - HALF_OPEN
        if excess <= 0:
            return
        spared = {address for _, _, address in self._let_in}
        found = [
            (each.address in spared, each.since, descriptor)
            for descriptor, each in self._open.items()
            if not each.shut and each.since > young
        ]
        for _, _, descriptor in sorted(found)[:excess]:
            self._open[descriptor].shut = True
            self.shut += 1
            with suppress(OSError), self._connection(descriptor) as connection:
                connection.shutdown(socket.SHUT_RDWR)

    def _peer(self, descriptor: int) -> str:
        try:
            with self._connection(descriptor) as connection:
                return str(connection.getpeername()[0])
        except (OSError, IndexError):
            return ""

    def _connection(self, descriptor: int) -> socket.socket:
        """Return a copy of a connection; OSError if it is another file by now, or of another port."""
        found = socket.socket(fileno=os.dup(descriptor))
        if found.family not in (socket.AF_INET, socket.AF_INET6) or found.getsockname()[1] != self.place:
            found.close()
            raise OSError("no connection of this port")
        return found

    def let_in(self, user: str, address: str) -> bool:
        """Note that someone has shown a key; return whether there is room.

        ZeroMQ does not say which connection a key came from. One that is older than a handshake may take has
        shown its key; younger ones are counted by their keys.
        """
        now = time.monotonic()
        while self._let_in and self._let_in[0][0] < now - HANDSHAKE:
            self._let_in.popleft()
        self.count()
        settled = sum(each.since < now - HANDSHAKE for each in self._open.values())
        if settled + len(self._let_in) >= CONNECTIONS:
            return False
        if sum(name == user for _, name, _ in self._let_in) >= HANDSHAKES:
            return False
        self._let_in.append((now, user, address))
        return True

    def receive(self) -> Letter | None:
        """Return the next message, or None if there is none now."""
        try:
            frames = self.socket.recv_multipart(zmq.NOBLOCK, copy=False)
        except zmq.Again:
            return None
        identity = frames[0].bytes
        last: Any = frames[-1]
        facts = {}
        for name in ("User-Id", "Peer-Address"):
            with suppress(zmq.ZMQError):
                facts[name] = last.get(name)
        # A name that the host chose might be that of someone whose answers are still to come.
        whole = len(frames) == 2 and len(identity) == _OURS and identity[0] == 0
        data = frames[1].bytes if whole else None
        return Letter(identity, facts.get("User-Id", ""), facts.get("Peer-Address", ""), data)

    def close(self) -> None:
        """Close the port, then the socket; what was sent has a moment to leave."""
        self.count()
        self.socket.disable_monitor()
        self.monitor.close(0)
        self.socket.close(100)
