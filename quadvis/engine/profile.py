"""Profiles: how long each call of a block's method takes, and when the first calls were.

The times of the calls that one thread makes lie in words of 8 bytes, which another process may read. A thread
can be asked for one measurement after the other while it runs. These have numbers that grow, odd ones; the
even number behind one says that it is over.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

EVENTS = 200_000  # calls whose instants are kept
TRIALS = 1000  # calls by which the cost of timing is measured
METHODS = 8  # of a block, at most

# Words of a method; of the calls: how many are kept, how many have room, the number of the measurement; then
# the words of each.
COUNT, TOTAL, LEAST, MOST = range(4)  # ns
METHOD = 4
KEPT, ROOM, MEASUREMENT, FIRST = range(4)
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


class TimedMethod(NamedTuple):
    """A method of a block whose calls are timed: path, method, task."""

    block: str
    method: str
    task: str


def started(measurement: int) -> int:
    """Return the number of the measurement that began last, of which a number says that it is on or over."""
    return measurement - 1 | 1


class Profile:
    """The times of the calls that one thread makes, of so many ``blocks``.

    ``events`` are the words of its first ``calls``. All lies in ``words``, or else in memory of its own.
    """

    def __init__(self, blocks: int, calls: int | None = None, words: Any = None) -> None:
        calls = EVENTS if calls is None else calls
        if words is None:
            words = memoryview(bytearray(8 * self.size(blocks, calls))).cast("q")
        self._times, self.events = words[: METHOD * METHODS * blocks], words[METHOD * METHODS * blocks :]
        self.events[ROOM] = calls
        fresh: Any = np.tile([0, 0, 2**62, 0], METHODS * blocks)
        self._fresh = memoryview(fresh).cast("B").cast("q")
        self._numbers: dict[tuple[int, str], int] = {}

    @staticmethod
    def size(blocks: int, calls: int) -> int:
        """Return the number of words."""
        return METHOD * METHODS * blocks + FIRST + EVENT * calls

    @property
    def methods(self) -> list[tuple[int, str]]:
        """The methods that are timed, by their numbers: the number of the block, and the method."""
        return list(self._numbers)

    def words(self, block: int, method: str) -> tuple[int, Any]:
        """Return the number and the words of a method of a block."""
        number = self._numbers.setdefault((block, method), len(self._numbers))
        return number, self._times[METHOD * number : METHOD * (number + 1)]

    def begin(self, measurement: int) -> None:
        """Begin a measurement anew if its number is odd, or let it be over."""
        if measurement % 2:
            self._times[:] = self._fresh
            self.events[KEPT] = 0
        self.events[MEASUREMENT] = measurement

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
        run, spent = Profile(1, TRIALS).timed(lambda: None, 0, ""), []
        for _ in range(TRIALS):
            begin = time.perf_counter()
            run()
            spent.append(time.perf_counter() - begin)
        return sorted(spent)[TRIALS // 2]

    def times(self) -> NDArray[np.int64]:
        """Return the words of all methods (N, 4)."""
        return np.array(self._times, np.int64).reshape(-1, METHOD)

    def calls(self) -> NDArray[np.int64]:
        """Return the calls that are kept (N, 3): the method's number, the begin and the time taken (ns)."""
        kept = self.events[KEPT]
        return np.array(self.events[FIRST : FIRST + EVENT * kept], np.int64).reshape(-1, EVENT)


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
    """What a measurement has found, as data that can be sent.

    ``calls`` are the first ones: the method's place in ``methods``, its begin from the first one on and its
    time (ns). ``cost`` is the time that the timing of one call takes (s), which is in no other number.
    ``first`` is when the first one began, on the monotonic clock (ns).
    """

    methods: tuple[Timed, ...]
    calls: tuple[tuple[int, int, int], ...]
    cost: float
    first: int = 0

    @staticmethod
    def of(
        profiles: Iterable[tuple[Profile, Sequence[TimedMethod]]], measurement: int
    ) -> ProfileReport | None:
        """Return what profiles, with the methods that they time, have found; None if nothing yet.

        ``measurement`` is the number of the one that is on or over. A thread that has not begun it yet has
        found nothing.
        """
        methods: list[Timed] = []
        found = [np.zeros((0, EVENT), np.int64)]
        for profile, named in profiles:
            if started(profile.events[MEASUREMENT]) != started(measurement):
                continue
            calls, times = profile.calls(), profile.times()  # a call that comes meanwhile is not among them
            places = np.full(len(times), -1)
            for number, (count, *each) in enumerate(times[: len(named)].tolist()):
                if count:
                    places[number] = len(methods)
                    methods.append(Timed(*named[number], count, *(time / 1e9 for time in each)))
            calls[:, NUMBER] = places[calls[:, NUMBER]]
            found.append(calls[calls[:, NUMBER] >= 0])
        if not methods:
            return None
        calls = np.concatenate(found)
        calls = calls[np.lexsort((calls[:, NUMBER], calls[:, BEGIN]))]
        first = int(calls[0, BEGIN]) if len(calls) else 0
        calls[:, BEGIN] -= first
        kept = tuple(map(tuple, calls.tolist()))
        return ProfileReport(tuple(methods), kept, Profile.cost(), first)
