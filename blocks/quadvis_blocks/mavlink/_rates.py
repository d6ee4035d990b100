"""The rates of messages that were asked for, measured, and asked for again: other stations set theirs."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping

WINDOW = 2.0  # s over which a rate is measured
AGAIN = 1.0  # s at least between two requests
ENOUGH = 0.8  # of the rate that was asked for


class MeasuredRates:
    """Messages by number, with the rates (Hz) at which they are wanted."""

    def __init__(self, wanted: Mapping[int, float]) -> None:
        self.wanted = {number: rate for number, rate in wanted.items() if rate > 0}
        self._arrivals: dict[int, deque[float]] = {number: deque() for number in self.wanted}
        self._asked = -1.0  # when the last request went out; below 0: never
        self.requests = 0
        self.slow: dict[int, float] = {}  # the rates that were too low, by number, at the last request

    def note(self, number: int, time: float) -> None:
        """Take note of a message."""
        if number in self._arrivals:
            self._arrivals[number].append(time)

    def due(self, time: float) -> dict[int, float]:
        """Return the rates to ask for now, by number: all at first, later those of messages that are slow."""
        first = self._asked < 0
        if not first and time < self._asked + AGAIN:
            return {}
        self.slow = (
            {}
            if first
            else {number: rate for number, rate in self._rates(time) if self._is_slow(number, rate)}
        )
        asked = dict(self.wanted) if first else {number: self.wanted[number] for number in self.slow}
        if asked:
            self._asked = time
            self.requests += 1
        return asked

    def _is_slow(self, number: int, rate: float) -> bool:
        return rate < ENOUGH * self.wanted[number]

    def _rates(self, time: float) -> Iterator[tuple[int, float]]:
        """Yield what has come since the last request, over the window at most, as rates."""
        since = max(self._asked, time - WINDOW)
        for number, arrivals in self._arrivals.items():
            while arrivals and arrivals[0] <= since:
                arrivals.popleft()
            yield number, len(arrivals) / (time - since)
