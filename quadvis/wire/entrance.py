"""One ROUTER socket of a target: it opens, counts who is connected, and gives each message with its sender.

The listening TCP socket is ours; ZeroMQ gets a copy of it. If too many connections have shown no key yet, the
copy is closed until they are gone: meanwhile the system keeps a few new ones waiting, and we hold nothing.
"""

from __future__ import annotations

import os
import socket
import time
from collections import deque
from contextlib import suppress
from typing import Any, NamedTuple

import zmq
from zmq.utils.monitor import recv_monitor_message

from quadvis.wire.keys import KeyPair
from quadvis.wire.limits import (
    CONNECTIONS,
    DEAD_AFTER,
    HALF_OPEN,
    HANDSHAKE,
    HANDSHAKES,
    HEARTBEAT,
    MESSAGE,
    QUEUED,
)  # fmt: skip
from quadvis.wire.outbox import Outbox

_EVENTS = zmq.Event.ACCEPTED | zmq.Event.DISCONNECTED
_RECEIVED = 8  # messages of one connection that libzmq holds for us
_OURS = 5  # bytes of an identity that libzmq made, which begins with a zero


class Letter(NamedTuple):
    """A message with what the transport says of its sender; ``data`` is None if it has a wrong form."""

    identity: bytes
    user: str
    address: str
    data: bytes | None


class Entrance:
    """A ROUTER socket; ``pair`` is the target's key, or None for CURVE's absence on this computer."""

    def __init__(self, context: zmq.Context[Any], number: int, verbs: str, pair: KeyPair | None) -> None:
        self.number, self.verbs = number, verbs
        self.domain = f"quadvis-{number}"
        self.pair = pair
        self.socket = made = context.socket(zmq.ROUTER)
        made.linger = 0
        made.router_mandatory = True
        made.rcvhwm, made.sndhwm = _RECEIVED, QUEUED
        made.maxmsgsize = MESSAGE
        made.handshake_ivl = int(HANDSHAKE * 1000)
        made.heartbeat_ivl, made.heartbeat_timeout = int(HEARTBEAT * 1000), int(DEAD_AFTER * 1000)
        made.zap_domain = self.domain.encode()
        if pair is not None:
            made.curve_server = True
            made.curve_secretkey, made.curve_publickey = pair.private, pair.public
        self.monitor = made.get_monitor_socket(_EVENTS)
        self.outbox = Outbox(made)
        self.listener: socket.socket | None = None
        self.place: int | str = 0
        self._endpoint = ""
        self._since: dict[int, float] = {}  # when each open connection was accepted, by its descriptor
        self._let_in: deque[tuple[float, str]] = deque()  # who has shown which key since a handshake's time

    def open_path(self, path: str) -> None:
        """Listen at a path of this computer."""
        self.socket.bind(f"ipc://{path}")
        self.place = path

    def open_port(self, listener: socket.socket) -> None:
        """Listen at a TCP socket that is bound."""
        self.listener = listener
        self.place = listener.getsockname()[1]
        if listener.family == socket.AF_INET6:
            self.socket.ipv6 = True
        listener.listen(CONNECTIONS)
        self._open()

    def _open(self) -> None:
        assert self.listener is not None
        self.socket.setsockopt(zmq.USE_FD, os.dup(self.listener.fileno()))
        host = "[::]" if self.listener.family == socket.AF_INET6 else "0.0.0.0"
        self.socket.bind(f"tcp://{host}:{self.place}")
        self._endpoint = self.socket.last_endpoint.decode()

    def count(self) -> int:
        """Note who came and went; shut or open the port. Return how many are connected."""
        while self.monitor.poll(0):
            event = recv_monitor_message(self.monitor)
            if event["event"] == zmq.Event.ACCEPTED:
                self._since[int(event["value"])] = time.monotonic()
            else:
                self._since.pop(int(event["value"]), None)
        if self.listener is None:
            return len(self._since)
        if self._endpoint and len(self._since) >= CONNECTIONS + HALF_OPEN:
            self.socket.unbind(self._endpoint)
            self._endpoint = ""
        elif not self._endpoint and len(self._since) < CONNECTIONS + HALF_OPEN // 2:
            self._open()
        return len(self._since)

    @property
    def shut(self) -> bool:
        """Whether the port is closed for new connections."""
        return self.listener is not None and not self._endpoint

    def let_in(self, user: str) -> bool:
        """Note that someone has shown a key; return whether there is room.

        ZeroMQ does not say which connection a key came from. One that is older than a handshake may take has
        shown its key; younger ones are counted by their keys.
        """
        now = time.monotonic()
        while self._let_in and self._let_in[0][0] < now - HANDSHAKE:
            self._let_in.popleft()
        self.count()
        settled = sum(since < now - HANDSHAKE for since in self._since.values())
        if settled + len(self._let_in) >= CONNECTIONS:
            return False
        if sum(name == user for _, name in self._let_in) >= HANDSHAKES:
            return False
        self._let_in.append((now, user))
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
        if self.listener is not None:
            self.listener.close()
