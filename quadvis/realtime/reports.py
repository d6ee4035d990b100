"""What blocks report during a run, in sentences, on their way to the supervisor.

A loop writes no text. These few sentences are an exception: a device reports once what went wrong and goes
on. Their number is limited, so that they always find room in the pipe, whether or not somebody reads it.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Protocol

from quadvis.realtime.schedule import NANOSECONDS

MOST = 50  # sentences of an application
LONGEST = 500  # characters of one; a pipe has room for 64 kB


class RunClock(Protocol):
    """The clock of a loop."""

    def now(self) -> int:
        """Return the time since the start (ns)."""


class Reports:
    """Takes sentences, from any task."""

    def __init__(self, link: Connection, clock: RunClock) -> None:
        self._link, self._clock = link, clock
        self._left = MOST
        self._lock = threading.Lock()

    def take(self, sentence: str) -> None:
        """Hand on a sentence with its time, or drop it if there were too many."""
        with self._lock:
            if self._left <= 0:
                return
            self._left -= 1
            time = self._clock.now() / NANOSECONDS
            with suppress(OSError):  # the supervisor has ended
                self._link.send(f"t = {time:.3f} s: {sentence[:LONGEST]}")
