"""What each key may cost, and what was refused: token buckets and counts."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable, Hashable
from contextlib import suppress

_MOST = 1000  # buckets; full ones are forgotten first


class Budget:
    """A token bucket for each key: ``rate`` tokens a second, at most ``burst`` of them."""

    def __init__(self, rate: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.rate, self.burst = rate, burst
        self._clock = clock
        self._buckets: dict[Hashable, tuple[float, float]] = {}  # tokens, and when there were so many

    def spend(self, key: Hashable, cost: float = 1.0) -> bool:
        """Take tokens out of a bucket; return whether there was at least one.

        A bucket may become negative: a long message is paid for afterwards.
        """
        left = self.left(key)
        if left < 1:
            return False
        if len(self._buckets) >= _MOST and key not in self._buckets:
            self._forget()
        self._buckets[key] = left - cost, self._clock()
        return True

    def charge(self, key: Hashable, cost: float) -> None:
        """Take tokens for what has been done already."""
        self._buckets[key] = self.left(key) - cost, self._clock()

    def left(self, key: Hashable) -> float:
        """Return how many tokens a key has."""
        tokens, then = self._buckets.get(key, (self.burst, 0.0))
        return min(self.burst, tokens + (self._clock() - then) * self.rate)

    def _forget(self) -> None:
        for key in [key for key in self._buckets if self.left(key) >= self.burst] or [
            next(iter(self._buckets))
        ]:
            del self._buckets[key]


class Tally:
    """Counts by name, which several threads add to."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._lock = threading.Lock()

    def add(self, name: str, count: int = 1) -> None:
        """Count something."""
        with self._lock:
            self._counts[name] += count

    def __getitem__(self, name: str) -> int:
        with self._lock:
            return self._counts[name]

    def all(self) -> dict[str, int]:
        """Return all counts."""
        with self._lock:
            return dict(self._counts)


def sparing(
    say: Callable[[str], object], clock: Callable[[], float] = time.monotonic
) -> Callable[[str], None]:
    """Return a way to say few sentences a second, and then how many were left out."""
    budget = Budget(1.0, 5.0, clock)
    unsaid = 0

    def said(words: str) -> None:
        nonlocal unsaid
        if not budget.spend(""):
            unsaid += 1
            return
        with suppress(Exception):  # a terminal that is closed must not end a target
            say(f"{words} ({unsaid} sentences were left out before)" if unsaid else words)
        unsaid = 0

    return said
