"""One open page: what waits for it, and what it no longer gets because it is slow or looks elsewhere."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable

FRESH = 1.0  # s; a page that has not answered a beat for so long sees old data
WAITING = 1_000_000  # bytes of samples that wait for a page
REPLIES = 16_000_000  # bytes of replies and events that wait for a page: more, and it is given up

Send = Callable[[str | bytes], Awaitable[None]]


class Viewer:
    """What one page is to get, in three ways.

    Of status and values only the newest waits. Samples wait up to a limit; then the oldest are dropped and
    counted. Replies and events all wait. While the page does not answer beats it gets neither values nor
    samples, so that it begins with new ones when it is back, and never works off old ones.
    """

    def __init__(self, give_up: Callable[[], None], now: Callable[[], float] = time.monotonic) -> None:
        self.give_up = give_up  # cuts the connection
        self.dropped = 0  # messages of values and samples
        self.watched: frozenset[str] = frozenset()
        self.listens: frozenset[str] = frozenset()
        self.scopes: set[int] = set()  # that it has added to the target
        self.gone = False  # too slow to be told what it asked for
        self._now = now
        self._seen = now()
        self._beats: deque[tuple[int, float]] = deque(maxlen=64)
        self._newest: dict[str, str] = {}
        self._samples: deque[bytes] = deque()
        self._size = self._owed = 0
        self._told: deque[str | bytes] = deque()
        self._wake = asyncio.Event()

    @property
    def fresh(self) -> bool:
        """Whether what the page shows is at most `FRESH` old."""
        return self.silent <= FRESH

    @property
    def silent(self) -> float:
        """Time since the newest beat that the page has answered was sent (s)."""
        return self._now() - self._seen

    def beat(self, number: int, message: str) -> None:
        """Send a beat; the page is to answer it once it shows what came before."""
        self._beats.append((number, self._now()))
        self._put_newest("beat", message)

    def answered(self, number: object) -> None:
        """Note that the page has answered a beat."""
        for known, sent in self._beats:
            if known == number:
                self._seen = max(self._seen, sent)

    def newest(self, topic: str, message: str) -> None:
        """Send the newest of a topic, in the place of an older one that still waits."""
        if not self.fresh:
            self.dropped += 1
            return
        self._put_newest(topic, message)

    def samples(self, message: bytes) -> None:
        """Send samples."""
        if not self.fresh:
            self.dropped += 1
            return
        self._samples.append(message)
        self._size += len(message)
        while self._size > WAITING:
            self._size -= len(self._samples.popleft())
            self.dropped += 1
        self._wake.set()

    def tell(self, message: str | bytes) -> None:
        """Send a reply or an event, which is never dropped."""
        self._owed += len(message)
        self.gone = self.gone or self._owed > REPLIES
        if self.gone:
            self._told.clear()
        else:
            self._told.append(message)
        self._wake.set()

    def _put_newest(self, topic: str, message: str) -> None:
        self._newest[topic] = message
        self._wake.set()

    async def deliver(self, send: Send) -> None:
        """Send what waits, one message after another, until the page is gone."""
        while not self.gone:
            await self._wake.wait()
            self._wake.clear()
            while (message := self._next()) is not None:
                await send(message)

    def _next(self) -> str | bytes | None:
        if self._told:
            message = self._told.popleft()
            self._owed -= len(message)
            return message
        if self._newest:
            return self._newest.pop(next(iter(self._newest)))
        if self._samples:
            samples = self._samples.popleft()
            self._size -= len(samples)
            return samples
        return None
