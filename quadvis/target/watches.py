"""Sets of signals that hosts watch: their newest numbers are published as soon as there are new ones."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from operator import is_
from typing import Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.target.newest import NewestValues

SETS = 16
SIGNALS = 2000  # of all sets
MANY, REST = 500, 0.1  # a set of so many numbers is published so seldom (s): nobody reads all that at once

Publish = Callable[[str, Mapping[str, Any], Any], None]


class Watches:
    """The sets of an application, each with a topic of its own; hosts that watch the same share one.

    ``wants(topic)`` says whether anybody listens. A set that nobody listens to makes room for a new one.
    `add` is called by the thread of the wire, `tell` by that of the session.
    """

    def __init__(self, newest: NewestValues, publish: Publish, wants: Callable[[str], bool]) -> None:
        self._newest, self._publish, self._wants = newest, publish, wants
        self._sets: dict[tuple[str, ...], _WatchedSet] = {}
        self._next = 0

    def add(self, names: Sequence[str]) -> dict[str, Any]:
        """Return the topic of a set of signals, its mark, and how many numbers each signal has.

        QuadvisError if there is no such signal, or no room.
        """
        key = tuple(dict.fromkeys(names))
        if key not in self._sets:
            self._next = self._next % 9999 + 1
            made = _WatchedSet(self._newest, key, f"values/{self._next}")
            kept = dict(self._sets)
            while len(kept) >= SETS or sum(map(len, kept)) + len(key) > SIGNALS:
                idle = next((each for each, one in kept.items() if not self._wants(one.topic)), None)
                if idle is None:
                    raise QuadvisError(
                        f"hosts may watch {SETS} sets of together {SIGNALS} signals; end one of them"
                    )
                del kept[idle]
            self._sets = kept | {key: made}  # the session may be going through the other one
        found = self._sets[key]
        return {"topic": found.topic, "set": found.mark, "sizes": found.sizes}

    def tell(self) -> None:
        """Publish the newest numbers of all sets that somebody listens to, if there are new ones."""
        now = time.monotonic()
        for one in self._sets.values():
            if self._wants(one.topic) and now >= one.due and (found := one.news()) is not None:
                one.due = now + one.rest
                numbers, without = found
                self._publish(one.topic, {"set": one.mark, "without": without}, numbers)


class _WatchedSet:
    """The places of some signals in the rows of their blocks."""

    def __init__(self, newest: NewestValues, names: Sequence[str], topic: str) -> None:
        self.topic = topic
        self._newest = newest
        found = [newest.place(name) for name in names]
        self.sizes = [len(place.slots) for place in found]
        self.rest, self.due = REST if sum(self.sizes) >= MANY else 0.0, 0.0  # s; the clock's time (s)
        facts = [(name, len(place.slots), place.type) for name, place in zip(names, found, strict=True)]
        self.mark = hashlib.sha256(repr(facts).encode()).hexdigest()[:12]
        widths = {place.block: place.width for place in found}
        firsts = dict(zip(widths, np.cumsum([0, *widths.values()]), strict=False))
        self._empty = {block: np.zeros(width, np.int64) for block, width in widths.items()}
        self._blocks = [place.block for place in found]
        # Where the numbers are once the rows of all blocks lie one after another.
        self._slots = np.concatenate([firsts[place.block] + place.slots for place in found])
        kinds = np.repeat([place.type for place in found], self.sizes)
        self._whole, self._logical = np.flatnonzero(kinds == "int64"), np.flatnonzero(kinds == "bool")
        self._rows: list[Any] = [None] * len(widths)

    def news(self) -> tuple[Any, list[int]] | None:
        """Return all numbers (N,) and the places of signals that have none yet; None if nothing is new."""
        rows = [self._newest.row(block) for block in self._empty]
        if all(map(is_, rows, self._rows)):
            return None
        self._rows = rows
        lacking = {block for block, row in zip(self._empty, rows, strict=True) if row is None}
        whole = [empty if row is None else row for empty, row in zip(self._empty.values(), rows, strict=True)]
        words = np.concatenate(whole)[self._slots]
        numbers = words.view(np.float64)
        if len(self._whole) or len(self._logical):
            numbers = numbers.copy()
            numbers[self._whole] = words[self._whole]
            numbers[self._logical] = words[self._logical] != 0
        without = [place for place, block in enumerate(self._blocks) if block in lacking] if lacking else []
        return numbers, without
