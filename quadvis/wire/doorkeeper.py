"""Who may come in: the answers to ZeroMQ's questions at each handshake (ZAP, https://rfc.zeromq.org/spec/27)."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

import zmq

from quadvis.wire.address import LOOPBACK
from quadvis.wire.budget import Tally
from quadvis.wire.entrance import Entrance
from quadvis.wire.hosts import AuthorizedHosts

LOCAL = "local"  # the user name of whoever is on this computer, which no key can be
_ZAP = "inproc://zeromq.zap.01"


class Doorkeeper:
    """Answers each handshake of all entrances of a context: the user name is the public key as text."""

    def __init__(
        self,
        context: zmq.Context[Any],
        hosts: AuthorizedHosts | None,
        counts: Tally,
        say: Callable[[str], object],
    ) -> None:
        self.socket = context.socket(zmq.REP)
        self.socket.linger = 0
        self.socket.bind(_ZAP)
        self._hosts, self._counts, self._say = hosts, counts, say

    def answer(self, entrances: Mapping[str, Entrance]) -> None:
        """Answer the handshakes that wait."""
        while self.socket.poll(0):
            version, number, domain, place, _, mechanism, *shown = self.socket.recv_multipart()
            address = place.decode("ascii", "replace")
            entrance = entrances.get(domain.decode("ascii", "replace"))
            user = self._user(entrance, address, mechanism, shown)
            status = b"400"
            if user and entrance is not None:
                status = b"200" if entrance.let_in(user, address) else b"500"
            if status != b"200":
                why = "a key that is not on the list" if status == b"400" else "a host too many"
                key = f", {shown[0].hex()}" if len(shown) == 1 and len(shown[0]) == 32 else ""
                self._say(f"turned away {why}, from {address or 'here'}{key}")
            self._counts.add({b"200": "let in", b"400": "turned away", b"500": "no room"}[status])
            reply = [version, number, status, b"", user.encode() if status == b"200" else b"", b""]
            self.socket.send_multipart(reply)

    def _user(self, entrance: Entrance | None, address: str, mechanism: bytes, shown: list[bytes]) -> str:
        """Return the user name of who shows a key, or "" for a stranger."""
        if entrance is None:
            return ""
        if entrance.pair is None:
            return LOCAL if mechanism == b"NULL" and _is_local(entrance, address) else ""
        if mechanism != b"CURVE" or len(shown) != 1 or self._hosts is None:
            return ""
        self._hosts.refresh()
        host = self._hosts.find(shown[0], address)
        return shown[0].hex() if host is not None else ""

    def close(self) -> None:
        """Close the socket."""
        self.socket.close(0)


def _is_local(entrance: Entrance, address: str) -> bool:
    """Return whether who comes without a key is on this computer; at a path, whether it is the same user."""
    if isinstance(entrance.place, int):
        return address.removeprefix("::ffff:") in LOOPBACK
    user = address.split(":")[1:2]  # ":user:group:process" where the system tells
    return not user or user[0] in (str(os.geteuid()), "0")
