"""The operator's lease: one host at a time changes what a target does, as long as it shows signs of life."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable

from quadvis.wire.limits import LEASE
from quadvis.wire.refusals import BusyError, GoneError
from quadvis.wire.who import Who


class Lease:
    """Who is the operator. The lease is taken while nobody has it, renewed, and released or lost.

    ``on_lost`` is called with the host that was silent for too long, at the next `watch` or use of the lease.
    Other threads may ask for `operator`.
    """

    def __init__(
        self,
        on_lost: Callable[[Who], object] = lambda who: None,
        lasts: float = LEASE,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.lasts = lasts
        self.lost = 0
        self._on_lost, self._clock = on_lost, clock
        self._holder: Who | None = None
        self._token = ""
        self._until = 0.0
        self._lock = threading.Lock()

    @property
    def operator(self) -> Who | None:
        """The host that has the lease, or None."""
        with self._lock:
            return self._holder if self._clock() < self._until else None

    def watch(self) -> float | None:
        """Take the lease from an operator who is silent; return the time until this is due (s), or None."""
        with self._lock:
            holder, left = self._holder, self._until - self._clock()
            if holder is None:
                return None
            if left > 0:
                return left
            self._end()
            self.lost += 1
        self._on_lost(holder)
        return None

    def withdraw(self) -> None:
        """Take the lease from the operator, whose key is let in no more."""
        with self._lock:
            holder = self._holder
            self._end()
            self.lost += holder is not None
        if holder is not None:
            self._on_lost(holder)

    def take(self, who: Who) -> str:
        """Make a host the operator and return the token of the lease; BusyError if there is another one."""
        self.watch()
        with self._lock:
            if self._holder is not None and self._holder.connection != who.connection:
                raise BusyError(
                    f"{self._holder.name} is the operator; wait until the lease is released or lost"
                )
            self._holder, self._token = who, secrets.token_hex(16)
            self._until = self._clock() + self.lasts
            return self._token

    def renew(self, who: Who, token: str) -> None:
        """Keep the lease, also on a new connection of the same key; GoneError if it is lost."""
        self.watch()
        with self._lock:
            self._check(who, token)
            self._holder, self._until = who, self._clock() + self.lasts

    def release(self, who: Who, token: str) -> None:
        """Give the lease back; GoneError if it is lost."""
        self.watch()
        with self._lock:
            self._check(who, token)
            self._end()

    def check(self, who: Who) -> None:
        """Raise BusyError or GoneError unless a host is the operator on this connection."""
        self.watch()
        with self._lock:
            if self._holder is None:
                raise GoneError("this needs the operator's lease, which nobody has; take it with 'lease'")
            if self._holder.connection != who.connection:
                raise BusyError(f"this needs the operator's lease, which {self._holder.name} has")

    def _check(self, who: Who, token: str) -> None:
        mine = self._holder is not None and self._holder.public == who.public
        if not mine or not secrets.compare_digest(token, self._token):
            raise GoneError("the lease is lost; take it again with 'lease'")

    def _end(self) -> None:
        self._holder, self._token, self._until = None, "", 0.0
