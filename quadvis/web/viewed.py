"""What the gateway needs of a target, whoever brings it: requests, streams, and the level of its key."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

Taker = Callable[[Mapping[str, Any], Any], None]
"""Takes the header of stream data and its array, or None."""


class ViewedTarget(Protocol):
    """A target as the gateway sees it. All of it may be called from any thread, and by several at once."""

    @property
    def name(self) -> str:
        """The name of the target."""

    @property
    def level(self) -> int:
        """The level of the key by which it is reached: 0 may do all, 4 may see the status alone."""

    def request(self, verb: str, /, **arguments: Any) -> Any:
        """Do what a verb says and return plain data; QuadvisError says why it is refused.

        The argument ``deadline`` is how long the target may take (s).
        """

    def subscribe(self, topic: str, take: Taker) -> Callable[[], None]:
        """Have stream data of a topic handed over, in a thread of the target's; return what ends that."""
