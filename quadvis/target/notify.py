"""What a service says to systemd, if it was started by it: that it is ready, that it lives, that it ends."""

from __future__ import annotations

import os
import socket
from contextlib import suppress

READY, ALIVE, STOPPING = "READY=1", "WATCHDOG=1", "STOPPING=1"
MICROSECONDS = 1e6


class Notifier:
    """Says words to systemd over the socket that it has named in the environment; see sd_notify(3)."""

    def __init__(self) -> None:
        self._address = os.environ.get("NOTIFY_SOCKET", "")
        watchdog = os.environ.get("WATCHDOG_USEC", "")
        mine = os.environ.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        self.period = int(watchdog) / MICROSECONDS / 2 if watchdog.isdigit() and mine else None  # s

    def say(self, words: str) -> None:
        """Say it; systemd need not be there."""
        if not self._address:
            return
        place = "\0" + self._address[1:] if self._address.startswith("@") else self._address
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as to:
            to.sendto(words.encode(), place)
