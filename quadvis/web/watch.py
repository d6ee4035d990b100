"""The newest numbers of the signals that pages show: the target sends them once for all pages."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.web.messages import MOST_NAMES
from quadvis.web.viewed import ViewedTarget

SIGN = 0.4  # s without numbers, or without a word from the target, until it is asked

Found = Callable[[str, Mapping[str, Any], Any], None]
"""Takes a topic, a header, and an array or None."""


class SignalWatch:
    """A thread that has a target send numbers, and asks it when it sends none, and whether it is still there.

    ``found`` takes topics for pages, in this thread or in the target's: "watched" says which signals are
    watched, with the mark of their set; "values" has their numbers, with this mark; "state" is the status of
    the target. ``heard`` is the time (monotonic, s) at which the target was last heard of.
    """

    def __init__(self, target: ViewedTarget, found: Found) -> None:
        self.heard = 0.0
        self._target, self._found = target, found
        self._names: list[str] = []
        self._asked: list[str] = []  # those that the target sends
        self._set = ""  # their mark
        self._came = 0.0  # when numbers came, by themselves or since they were asked for
        self._topic = ""  # what the target sends
        self._unsubscribe: Callable[[], None] = lambda: None
        self._wake, self._ended = threading.Event(), False
        self._thread = threading.Thread(target=self._look, name="watch", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End; a request that is under way is not waited for."""
        self._ended = True
        self._wake.set()

    def names(self, names: set[str]) -> None:
        """Watch other signals, and at once."""
        found = sorted(names)[:MOST_NAMES]
        if found != self._names:
            self._names = found
            self._wake.set()

    def _look(self) -> None:
        while not self._ended:
            for ask in (self._ask_numbers, self._ask_status):
                with suppress(QuadvisError):  # no application, or another one: its pages watch others soon
                    ask()
            self._wake.wait(SIGN)
            self._wake.clear()
        with suppress(QuadvisError):
            self._follow("")

    def _ask_numbers(self) -> None:
        names = self._names
        if not names:
            self._follow("")
            self._asked = []
        elif names != self._asked or time.monotonic() - self._came > SIGN:
            facts = self._target.request("watch", names=names)
            values = self._target.request("getsignal", names=names)
            self.heard = self._came = time.monotonic()
            if facts["set"] != self._set:
                self._set = facts["set"]
                self._found("watched", {"set": self._set, "names": names, "sizes": facts["sizes"]}, None)
            self._found("values", *_numbers(self._set, facts["sizes"], [values[name] for name in names]))
            self._follow(facts["topic"])
            self._asked = names

    def _ask_status(self) -> None:
        if time.monotonic() - self.heard > SIGN:
            status = self._target.request("status")
            self.heard = time.monotonic()
            self._found("state", status, None)

    def _follow(self, topic: str) -> None:
        """Have the target send what belongs to a topic in the place of what it sends; "" for nothing."""
        if topic == self._topic:
            return
        self._topic, end, self._unsubscribe = "", self._unsubscribe, lambda: None
        end()
        if topic:
            self._unsubscribe = self._target.subscribe(topic, self._take)
            self._topic = topic

    def _take(self, header: Mapping[str, Any], array: Any) -> None:
        if header.get("set") == self._set:  # another application may have given the topic to another set
            self.heard = self._came = time.monotonic()
            self._found("values", header, array)


def _numbers(mark: str, sizes: Sequence[int], values: Sequence[Any]) -> tuple[Mapping[str, Any], Any]:
    """Return values as the target sends them: all numbers in an array, and the places of those without."""
    import numpy as np

    parts = [
        np.zeros(size) if value is None else np.ravel(np.asarray(value, float))
        for size, value in zip(sizes, values, strict=True)
    ]
    without = [place for place, value in enumerate(values) if value is None]
    return {"set": mark, "without": without}, np.concatenate(parts)
