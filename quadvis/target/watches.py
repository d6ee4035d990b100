"""Sets of signals that hosts watch: their newest numbers are published as soon as there are new ones."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.target.newest import NewestValues

SETS = 16
SIGNALS = 2000  # of all sets

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
        for one in self._sets.values():
            if self._wants(one.topic) and (found := one.news()) is not None:
                numbers, without = found
                self._publish(one.topic, {"set": one.mark, "without": without}, numbers)


class _WatchedSet:
    """The places of some signals in the rows of their blocks."""

    def __init__(self, newest: NewestValues, names: Sequence[str], topic: str) -> None:
        self.topic = topic
        self._newest = newest
        found = [newest.place(name) for name in names]
        self.sizes = [len(place.slots) for place in found]
        facts = [(name, len(place.slots), place.type) for name, place in zip(names, found, strict=True)]
        self.mark = hashlib.sha256(repr(facts).encode()).hexdigest()[:12]
        ends = np.cumsum([0, *self.sizes])
        self._pieces = [(each.block, each.slots, slice(*ends[at : at + 2])) for at, each in enumerate(found)]
        kinds = np.repeat([each.type for each in found], self.sizes)
        self._whole, self._logical = kinds == "int64", kinds == "bool"
        self._rows: list[Any] = []

    def news(self) -> tuple[Any, list[int]] | None:
        """Return all numbers (N,) and the places of signals that have none yet; None if nothing is new."""
        rows = [self._newest.row(block) for block, _, _ in self._pieces]
        if len(rows) == len(self._rows) and all(map(_same, rows, self._rows)):
            return None
        self._rows = rows
        words = np.zeros(len(self._whole), np.int64)
        for row, (_, slots, at) in zip(rows, self._pieces, strict=True):
            if row is not None:
                words[at] = row[slots]
        numbers = words.view(np.float64).copy()
        numbers[self._whole] = words[self._whole]
        numbers[self._logical] = words[self._logical] != 0
        return numbers, [place for place, row in enumerate(rows) if row is None]


def _same(one: object, other: object) -> bool:
    return one is other
