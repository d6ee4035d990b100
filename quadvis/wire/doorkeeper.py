"""Who may come in: what the porter asks at each handshake."""

from __future__ import annotations

import os
from collections.abc import Callable

from quadvis.wire.address import LOOPBACK
from quadvis.wire.budget import Tally
from quadvis.wire.hosts import AuthorizedHosts
from quadvis.wire.ports import ListeningSocket

LOCAL = "local"  # the user name of whoever is on this computer, which no key can be
# The status of a handshake, in ZeroMQ's numbers: its count, and why somebody was turned away.
_OUTCOMES = {
    200: ("let in", ""),
    400: ("turned away", "a key that is not on the list"),
    500: ("no room", "a host too many"),
}


class Doorkeeper:
    """Says who shows a key by the list of hosts; the user name is the public key as text."""

    def __init__(self, hosts: AuthorizedHosts | None, counts: Tally, say: Callable[[str], object]) -> None:
        self._hosts, self._counts, self._say = hosts, counts, say

    def user(self, listener: ListeningSocket, address: str, mechanism: str, key: bytes) -> str:
        """Return the user name of who comes from an address and shows a key, or "" for a stranger."""
        if not listener.keyed:
            return LOCAL if mechanism == "NULL" and _is_local(listener, address) else ""
        if mechanism != "CURVE" or self._hosts is None:
            return ""
        self._hosts.refresh()
        return key.hex() if self._hosts.find(key, address) is not None else ""

    def note(self, status: int, address: str, key: bytes) -> None:
        """Count how a handshake ended, and say who was turned away."""
        count, why = _OUTCOMES[status]
        self._counts.add(count)
        if why:
            shown = f", {key.hex()}" if len(key) == 32 else ""
            self._say(f"turned away {why}, from {address or 'here'}{shown}")


def _is_local(listener: ListeningSocket, address: str) -> bool:
    """Return whether who comes without a key is on this computer; at a path, whether it is the same user."""
    if isinstance(listener.place, int):
        return address.removeprefix("::ffff:") in LOOPBACK
    user = address.split(":")[1:2]  # ":user:group:process" where the system tells
    return not user or user[0] in (str(os.geteuid()), "0")
