"""What a host receives of the topics that it has subscribed to."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator

from quadvis.wire.messages import StreamData
from quadvis.wire.refusals import NoAnswerError, WireError


class Subscription:
    """Data of some topics in the order in which it came; the oldest is dropped if nobody takes it.

    ``missed`` counts what the target, the network or the queue here has dropped. With ``callback`` data is
    not kept: the callback gets it in the thread of the client, which it must not hold up.
    """

    def __init__(
        self, topics: tuple[str, ...], size: int, callback: Callable[[StreamData], object] | None
    ) -> None:
        self.topics = topics
        self.missed = 0
        self._callback, self._size = callback, size
        self._kept: deque[StreamData] = deque()
        self._last: dict[str, int] = {}
        self._arrived = threading.Condition()
        self._ended: WireError | None = None

    def take(self, timeout: float | None = None) -> StreamData:
        """Return the next data; NoAnswerError if there is none in time (s), or the reason of the end."""
        with self._arrived:
            self._arrived.wait_for(lambda: self._kept or self._ended, timeout)
            if self._kept:
                return self._kept.popleft()
            raise self._ended or NoAnswerError(f"no data of {', '.join(self.topics)} has come in time")

    def __iter__(self) -> Iterator[StreamData]:
        """Yield data until the subscription ends."""
        while True:
            try:
                yield self.take()
            except WireError:
                return

    def put(self, data: StreamData) -> None:
        """Take data from the wire; a number that is not the next one is a gap."""
        last = self._last.get(data.topic)
        self._last[data.topic] = data.number
        if last is not None and data.number > last + 1:
            self.missed += data.number - last - 1  # a smaller number is that of a target that began anew
        if self._callback is not None:
            self._callback(data)
            return
        with self._arrived:
            self._kept.append(data)
            if len(self._kept) > self._size:
                self._kept.popleft()
                self.missed += 1
            self._arrived.notify()

    def end(self, error: WireError) -> None:
        """Let `take` raise an error once nothing is kept any more."""
        with self._arrived:
            self._ended = error
            self._arrived.notify_all()
