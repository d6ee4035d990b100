"""A host's connection to a target: requests, the operator's lease where a verb needs it, streams."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from quadvis.wire.client import PATIENCE, Client
from quadvis.wire.verbs import VERBS

if TYPE_CHECKING:
    from quadvis.wire.subscription import Subscription


class HostConnection:
    """A connection to one target; any thread may use it.

    ``name`` is that of the target, ``level`` what this host's key may do there.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        hello = client.request("hello")
        self.name, self.level = str(hello["target"]), int(hello["level"])
        self._lock = threading.Lock()
        self._operators = 0  # threads that are the operator now
        self._subscriptions: dict[str, Subscription] = {}

    def request(self, verb: str, deadline: float = PATIENCE, **arguments: Any) -> Any:
        """Return what the target answers to a verb in time (s); QuadvisError with its sentence if not."""
        return self._client.request(verb, deadline, **arguments)

    def operate(self, verb: str, deadline: float = PATIENCE, **arguments: Any) -> Any:
        """Do as `request`, as the operator if the verb needs one; the lease is held for this moment."""
        declared = VERBS.get(verb)
        if declared is None or not declared.leased:
            return self.request(verb, deadline, **arguments)
        with self.operator():
            return self.request(verb, deadline, **arguments)

    @contextmanager
    def operator(self) -> Iterator[None]:
        """Be the operator inside; several threads may be there, and the last one gives the lease back."""
        with self._lock:
            if not self._client.operates:
                self._client.operate()
            self._operators += 1
        try:
            yield
        finally:
            with self._lock:
                self._operators -= 1
                if not self._operators:
                    self._client.release()

    def subscribe(self, topic: str, take: Callable[[Mapping[str, Any], Any], object]) -> None:
        """Let ``take(header, array)`` be called with the data of a topic, in the client's thread."""
        self.unsubscribe(topic)
        self._subscriptions[topic] = self._client.subscribe(
            topic, callback=lambda data: take(data.header, data.array)
        )

    def unsubscribe(self, topic: str) -> None:
        """Receive no more data of a topic."""
        subscription = self._subscriptions.pop(topic, None)
        if subscription is not None:
            self._client.unsubscribe(subscription)

    def close(self) -> None:
        """Close the connection; the target goes on."""
        self._client.close()


def connect(name: str | None, say: Callable[[str], object] = lambda words: None) -> HostConnection:
    """Return a connection to a target; without a name to that of this machine, started if needed."""
    from quadvis.host.local import LOCAL, started_here
    from quadvis.wire.meeting import meet

    if name is None:
        started_here()
        name = LOCAL
    return HostConnection(meet(name, say=say))
