"""How many requests a page may make."""

from __future__ import annotations

import time
from collections.abc import Callable

RATE = 50.0  # requests a second
BURST = 100.0  # requests at once, after a quiet time


class Allowance:
    """Requests that may still be made: they come back with time."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._left, self._at = BURST, now()

    def take(self) -> bool:
        """Use one; False if none is left."""
        now = self._now()
        self._left = min(BURST, self._left + RATE * (now - self._at))
        self._at = now
        if self._left < 1:
            return False
        self._left -= 1
        return True
