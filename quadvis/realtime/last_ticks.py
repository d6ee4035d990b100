"""The last ticks of a run: no application leaves its loop before all have run theirs.

So no computer ends, and no outputs become safe, while another one still has a tick to run; the processes
that end then hold nobody up.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

LONGEST_PAUSE = 0.01  # s between two signs of life
LONGEST_STAY = 10.0  # s after the stop time that an application waits, if no supervisor ends it


class LastTicks(NamedTuple):
    """The ``words`` that all applications share, one for each: not 0 once it has run its last tick.

    ``place`` is that of this application's word.
    """

    words: Any
    place: int

    def leave(self) -> None:
        """Let nobody wait for this application."""
        self.words[self.place] = 1

    def stay(self, remaining: float, interval: float, live: Callable[[], bool]) -> None:
        """Note that this application has run its last tick, and wait for the others.

        ``remaining`` is the time to the stop time (s). ``live`` is called more than once in an ``interval``
        (s): it gives a sign of life, and returns False if the run is to end; then nobody waits any more.
        """
        self.leave()
        end = time.monotonic() + max(0.0, remaining) + LONGEST_STAY
        while live() and not all(self.words) and time.monotonic() < end:
            time.sleep(min(interval / 2, LONGEST_PAUSE))
