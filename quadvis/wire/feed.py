"""Stream data: who has subscribed to which topics, and what has been published for them."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from quadvis.wire.budget import Tally
from quadvis.wire.limits import OUTGOING, SUBSCRIPTIONS
from quadvis.wire.messages import pack_stream
from quadvis.wire.porter import Key, Porter
from quadvis.wire.refusals import BadError, WireError
from quadvis.wire.verbs import check_topic
from quadvis.wire.who import Who


@dataclass
class _Subscriber:
    who: Who
    user: str
    address: str
    topics: set[str] = field(default_factory=set)


class Feed:
    """Hands what is published to each subscriber that may see it; other threads may publish.

    ``wake`` is called after something was published. Each topic has a number that grows by one with each
    message, whether anyone receives it or not; so whoever misses one sees it.
    """

    def __init__(self, counts: Tally, wake: Callable[[], object]) -> None:
        self._counts, self._wake = counts, wake
        self._subscribers: dict[Key, _Subscriber] = {}
        self._wanted: frozenset[str] = frozenset()
        self._lock = threading.Lock()
        self._numbers: Counter[str] = Counter()
        self._outgoing: deque[tuple[str, list[bytes], int]] = deque()
        self._size = 0

    def wants(self, topic: str) -> bool:
        """Return whether anybody has subscribed to a topic; any thread may ask."""
        return topic in self._wanted

    def publish(self, topic: str, header: Mapping[str, Any], array: Any = None) -> None:
        """Publish data of a topic; it is dropped and counted if too much waits already.

        UnknownError if there is no such topic; BadError if the data is too long or cannot be sent.
        """
        check_topic(topic, 0)
        with self._lock:
            self._numbers[topic] += 1
            if topic not in self._wanted:
                return
            frames = pack_stream(topic, self._numbers[topic], header, array)
            size = sum(map(len, frames))
            if self._size + size > OUTGOING:
                self._counts.add("unsent")
                return
            self._outgoing.append((topic, frames, size))
            self._size += size
        self._wake()

    def subscribe(self, who: Who, user: str, address: str, topics: list[str]) -> list[str]:
        """Add topics of a connection; refuse them all if one may not be seen."""
        for topic in topics:
            check_topic(topic, who.level)
        one = self._subscribers.get(who.connection) or _Subscriber(who, user, address)
        if len(one.topics.union(topics)) > SUBSCRIPTIONS:
            raise BadError(f"a connection can subscribe to {SUBSCRIPTIONS} topics")
        one.topics.update(topics)
        self._subscribers[who.connection] = one
        self._update()
        return sorted(one.topics)

    def unsubscribe(self, who: Who, topics: list[str]) -> list[str]:
        """Remove topics of a connection."""
        one = self._subscribers.get(who.connection)
        if one is None:
            return []
        one.topics.difference_update(topics)
        if not one.topics:
            self.forget(who.connection)
        self._update()
        return sorted(one.topics)

    def deliver(self, porter: Porter, present: Callable[[str, str, Key], Who | None]) -> None:
        """Send what waits to all who have subscribed; ``present`` says who a sender is now."""
        while porter.has_room:
            with self._lock:
                if not self._outgoing:
                    return
                topic, frames, size = self._outgoing.popleft()
                self._size -= size
            porter.send(list(self._allowed(topic, porter, present)), frames)

    def _allowed(
        self, topic: str, porter: Porter, present: Callable[[str, str, Key], Who | None]
    ) -> Iterator[Key]:
        """Yield who has subscribed to a topic and may see it; the others are forgotten."""
        for key, one in list(self._subscribers.items()):
            if topic not in one.topics:
                continue
            if self._may_see(topic, present(one.user, one.address, key)):
                yield key
            else:
                self._counts.add("refused")
                self.forget(key)
                porter.forget(key)

    def _may_see(self, topic: str, who: Who | None) -> bool:
        if who is None:
            return False
        try:
            check_topic(topic, who.level)
        except WireError:
            return False
        return True

    def forget(self, key: Key) -> None:
        """Send nothing more to a connection."""
        if self._subscribers.pop(key, None) is not None:
            self._update()

    def forget_all(self) -> None:
        """Send nothing more to anybody who is there now."""
        self._subscribers.clear()
        self._update()

    def subscribers(self, dropped: Callable[[Key], int]) -> Iterator[dict[str, Any]]:
        """Yield the name, the topics and the number of dropped messages of each subscriber."""
        for key, one in self._subscribers.items():
            yield {"host": one.who.name, "topics": sorted(one.topics), "dropped": dropped(key)}

    def _update(self) -> None:
        wanted = frozenset(topic for one in self._subscribers.values() for topic in one.topics)
        with self._lock:
            self._wanted = wanted
