"""Profiles: how long each call of a block's method takes, and when the first calls were."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

EVENTS = 200_000  # calls whose instants are kept
TRIALS = 1000  # calls by which the cost of timing is measured

# Words of a method; of the events: how many are kept, and how many have room; then the words of each.
COUNT, TOTAL, LEAST, MOST = range(4)  # ns
KEPT, ROOM, FIRST = range(3)
NUMBER, BEGIN, TAKEN = range(3)  # of the method; ns on the monotonic clock; ns
EVENT = 3


class Timed(NamedTuple):
    """The calls of a method of a block: how many, and their time in all, the shortest and the longest (s)."""

    block: str
    method: str
    task: str
    calls: int
    total: float
    least: float
    most: float


@dataclass
class Profile:
    """The times of the calls that one thread makes; ``events`` are its first ones, as words."""

    events: Any = field(default_factory=lambda: _words(FIRST + EVENT * EVENTS))
    methods: list[tuple[int, str, Any]] = field(default_factory=list)  # block, method, words

    def __post_init__(self) -> None:
        self.events[ROOM] = EVENTS

    def words(self, block: int, method: str) -> tuple[int, Any]:
        """Return the number and the words of a method of a block, which is new."""
        words = _words(MOST + 1)
        words[LEAST] = 2**62
        self.methods.append((block, method, words))
        return len(self.methods) - 1, words

    def timed(self, call: Callable[[], None], block: int, method: str) -> Callable[[], None]:
        """Return a call that is measured."""
        number, words = self.words(block, method)
        events, now = self.events, time.monotonic_ns

        def run() -> None:
            begin = now()
            call()
            record(words, events, number, begin, now() - begin)

        return run

    @staticmethod
    def cost() -> float:
        """Return how long the timing of one interpreted call takes here (s), the median of some."""
        run, spent = Profile().timed(lambda: None, 0, ""), []
        for _ in range(TRIALS):
            begin = time.perf_counter()
            run()
            spent.append(time.perf_counter() - begin)
        return sorted(spent)[TRIALS // 2]

    def __iter__(self) -> Iterator[tuple[int, str, int, int, int, int]]:
        for block, method, words in self.methods:
            if words[COUNT]:
                yield block, method, words[COUNT], words[TOTAL], words[LEAST], words[MOST]

    def calls(self) -> Iterator[tuple[int, str, int, int]]:
        """Yield the calls that are kept: the block, its method, the begin and the time taken (ns)."""
        for at in range(FIRST, FIRST + EVENT * self.events[KEPT], EVENT):
            block, method, _ = self.methods[self.events[at + NUMBER]]
            yield block, method, self.events[at + BEGIN], self.events[at + TAKEN]


def record(words: Any, events: Any, number: int, begin: int, taken: int) -> None:
    """Count a call; interpreted, or compiled by `quadvis.native.timing`."""
    words[COUNT] += 1
    words[TOTAL] += taken
    if taken < words[LEAST]:
        words[LEAST] = taken
    if taken > words[MOST]:
        words[MOST] = taken
    kept = events[KEPT]
    if kept < events[ROOM]:
        at = FIRST + EVENT * kept
        events[at + NUMBER], events[at + BEGIN], events[at + TAKEN] = number, begin, taken
        events[KEPT] = kept + 1


@dataclass(frozen=True)
class ProfileReport:
    """What the profiles of a run have found, as data that can be sent.

    ``calls`` are the first ones: the method's place in ``methods``, its begin from the first one on and its
    time (ns). ``cost`` is the time that the timing of one call takes (s), which is in no other number.
    ``first`` is when the first one began, on the monotonic clock (ns).
    """

    methods: tuple[Timed, ...]
    calls: tuple[tuple[int, int, int], ...]
    cost: float
    first: int = 0


def _words(count: int) -> memoryview[int]:
    return memoryview(bytearray(8 * count)).cast("q")
