"""The newest values of the signals that pages show: asked for once for all pages, some times a second."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.web.messages import MOST_NAMES
from quadvis.web.viewed import ViewedTarget

EVERY = 0.1  # s between two requests: a person reads no faster
SIGN = 0.4  # s without a word from the target until it is asked how it is


class SignalWatch:
    """A thread that asks a target for values, and whether it is still there.

    ``found`` takes the values by name, ``status`` that of the target, both in this thread. ``heard`` is the
    time (monotonic, s) at which the target was last heard of.
    """

    def __init__(
        self,
        target: ViewedTarget,
        found: Callable[[Mapping[str, Any]], None],
        status: Callable[[Mapping[str, Any]], None],
    ) -> None:
        self.heard = 0.0
        self._target, self._found, self._status = target, found, status
        self._names: list[str] = []
        self._wake, self._ended = threading.Event(), False
        self._thread = threading.Thread(target=self._ask, name="watch", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End; a request that is under way is not waited for."""
        self._ended = True
        self._wake.set()

    def names(self, names: set[str]) -> None:
        """Ask for other signals, and at once."""
        self._names = sorted(names)[:MOST_NAMES]
        self._wake.set()

    def _ask(self) -> None:
        due = time.monotonic()
        while not self._ended:
            due = max(due + EVERY, time.monotonic())
            try:
                self._ask_once()
            except QuadvisError:
                self._wake.wait(SIGN)  # no application, or another one: its pages watch other signals soon
            self._wake.wait(max(0.0, due - time.monotonic()))
            self._wake.clear()

    def _ask_once(self) -> None:
        if names := self._names:
            values = self._target.request("getsignal", names=names)
            self.heard = time.monotonic()
            self._found(values)
        if time.monotonic() - self.heard > SIGN:
            status = self._target.request("status")
            self.heard = time.monotonic()
            self._status(status)
