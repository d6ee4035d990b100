"""One open page: what waits for it, and what it no longer gets because it is slow or looks elsewhere."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable

from quadvis.web.line import PageLine

FRESH = 1.0  # s; a page that has not answered a beat for so long sees old data
WAITING = 1_000_000  # bytes of samples that wait for a page
AT_ONCE = 32_000  # bytes that are written together
REPLIES = 16_000_000  # bytes of replies and events that wait for a page: more, and it is given up


class Viewer:
    """What one page is to get, in three ways.

    Of status and values only the newest waits. Samples wait up to a limit; then the oldest are dropped and
    counted. Replies and events all wait. While the page does not answer beats it gets neither values nor
    samples, so that it begins with new ones when it is back, and never works off old ones.
    """

    def __init__(self, line: PageLine, now: Callable[[], float] = time.monotonic) -> None:
        self._line = line
        self.dropped = 0  # messages of values and samples
        self.watched: frozenset[str] = frozenset()
        self.listens: frozenset[str] = frozenset()
        self.scopes: set[int] = set()  # that it has added to the target
        self.gone = False  # too slow to be told what it asked for
        self._now = now
        self._seen = now()
        self._beats: deque[tuple[int, float]] = deque(maxlen=64)
        self._newest: dict[str, str | bytes] = {}
        self._samples: deque[str | bytes] = deque()
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
        self._newest["beat"] = message

    def answered(self, number: object) -> None:
        """Note that the page has answered a beat."""
        for known, sent in self._beats:
            if known == number:
                self._seen = max(self._seen, sent)

    def newest(self, topic: str, message: str | bytes) -> None:
        """Let the newest of a topic wait to be sent, in the place of an older one."""
        if not self.fresh:
            self.dropped += 1
            return
        self._newest[topic] = message

    def samples(self, message: str | bytes) -> None:
        """Let samples wait to be sent."""
        if not self.fresh:
            self.dropped += 1
            return
        self._samples.append(message)
        self._size += len(message)
        while self._size > WAITING:
            self._size -= len(self._samples.popleft())
            self.dropped += 1

    def tell(self, message: str | bytes) -> None:
        """Send a reply or an event, which is never dropped."""
        self._owed += len(message)
        self.gone = self.gone or self._owed > REPLIES
        if self.gone:
            self._told.clear()
        else:
            self._told.append(message)
        self._wake.set()

    def send(self) -> None:
        """Send what waits: at once, as far as the line is free for it."""
        while self._line.free():
            messages, size = [], 0
            while size < AT_ONCE and (message := self._next()) is not None:
                messages.append(message)
                size += len(message)
            if not messages:
                return
            self._line.write(messages)
        self._wake.set()

    async def deliver(self) -> None:
        """Send what has to wait, one message after another, until the page is gone."""
        while not self.gone:
            await self._wake.wait()
            self._wake.clear()
            while (message := self._next()) is not None:
                await self._line.send(message)

    def give_up(self) -> None:
        """Cut the connection."""
        self._line.cut()

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
