"""A mailbox in shared memory: a writer leaves records, a reader takes the newest; neither waits.

No lock is held by anyone, so whoever dies holds up nobody. Records are written in turn into several places.
The word before a record is minus its number while it is being written, and its number when it is whole: a
seqlock. A writer that dies in the middle spoils one place, and the record before it stays readable; a new
writer goes on with the next number.

The processor must let others see writes in their order, as x86-64 does. On one that does not, such as ARM,
nothing here guarantees that a record is whole when its number is there.
"""

from __future__ import annotations

from typing import Any

from quadvis.links.frame import Arrival

SLOT = 8
NEWEST = 0  # the number of the newest whole record; 0 before the first
HEAD = 8  # words before the records: a line of the processor's cache
MARK, STAMP, LENGTH, DATA = range(4)  # words of a record


class Mailbox:
    """Records of up to ``room`` bytes in ``count`` places; both processes make one over the same words.

    The words are 0 at the beginning. There is one writer at a time.
    """

    def __init__(self, words: Any, room: int, count: int) -> None:
        self._bytes = memoryview(words).cast("B")
        self._words = self._bytes.cast("q")
        self.room, self._count = room, count
        self._width = self._length(room)

    @staticmethod
    def size(room: int, count: int) -> int:
        """Return the number of words."""
        return HEAD + count * Mailbox._length(room)

    @staticmethod
    def _length(room: int) -> int:
        return DATA + -(-room // SLOT)

    def put(self, stamp: int, payload: bytes) -> None:
        """Leave a record; ValueError if it has no room."""
        if len(payload) > self.room:
            raise ValueError(f"a record of {len(payload)} bytes has no room in {self.room}")
        words = self._words
        number = words[NEWEST] + 1
        place = self._place(number)
        start = SLOT * (place + DATA)
        words[place + MARK] = -number
        words[place + STAMP] = stamp
        words[place + LENGTH] = len(payload)
        self._bytes[start : start + len(payload)] = payload
        words[place + MARK] = number
        words[NEWEST] = number

    def newest(self, before: int, after: int) -> Arrival | None:
        """Return the newest whole record with ``after`` < stamp < ``before`` (ns); None if there is none."""
        words = self._words
        latest = words[NEWEST]
        for number in range(latest, max(0, latest - self._count), -1):
            place = self._place(number)
            if words[place + MARK] != number:
                continue
            stamp, length = words[place + STAMP], words[place + LENGTH]
            if stamp >= before:
                continue
            if stamp <= after or not 0 <= length <= self.room:
                return None
            start = SLOT * (place + DATA)
            payload = bytes(self._bytes[start : start + length])
            if words[place + MARK] == number:
                return Arrival(stamp, payload)
        return None

    def _place(self, number: int) -> int:
        return HEAD + number % self._count * self._width
