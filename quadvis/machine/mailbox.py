"""A mailbox in shared memory: one process leaves records, another takes the newest whole one; neither waits.

No lock is held by anyone, so whoever dies holds up nobody. Records are written in turn into several places.
The word before a record is minus its number while it is being written, and its number when it is whole: a
seqlock. A writer that dies in the middle spoils one place, and the record before it stays readable; a new
writer goes on with the next number.

A processor such as ARM may show another one the number of a record before its bytes. A checksum of all that
belongs to the record tells this: the reader then gets the record before. It costs writer and reader some
0.25 ms a megabyte each.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any, NamedTuple

SLOT = 8
NEWEST = 0  # the number of the newest whole record; 0 before the first
HEAD = 8  # words before the records: a line of the processor's cache
MARK, STAMP, LENGTH, CHECK, DATA = range(5)  # words of a record
LAST = 2**63 - 1  # the largest stamp

_CHECKED = struct.Struct("<3q")


class Arrival(NamedTuple):
    """What came whole: when it was sent (ns of run time), and its bytes."""

    stamp: int
    payload: bytes


class Mailbox:
    """Records of up to ``room`` bytes in ``count`` places; both processes make one over the same words.

    The words are 0 at the beginning. There is one writer at a time. With three places, a record stays while
    the next two are written.
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

    def put(self, payload: bytes, stamp: int = 0) -> None:
        """Leave a record of an instant (ns, at least 0); ValueError if it has no room."""
        if len(payload) > self.room:
            raise ValueError(f"a record of {len(payload)} bytes has no room in {self.room}")
        words = self._words
        number = words[NEWEST] + 1
        place = self._place(number)
        start = SLOT * (place + DATA)
        words[place + MARK] = -number
        words[place + STAMP] = stamp
        words[place + LENGTH] = len(payload)
        words[place + CHECK] = _check(number, stamp, payload)
        self._bytes[start : start + len(payload)] = payload
        words[place + MARK] = number
        words[NEWEST] = number

    def newest(self, before: int = LAST, after: int = -1) -> Arrival | None:
        """Return the newest whole record with ``after`` < stamp < ``before`` (ns); None if there is none."""
        words = self._words
        latest = words[NEWEST]
        for number in range(latest, max(0, latest - self._count), -1):
            place = self._place(number)
            if words[place + MARK] != number:
                continue
            stamp, length, check = words[place + STAMP], words[place + LENGTH], words[place + CHECK]
            if stamp >= before or not 0 <= length <= self.room:
                continue
            if stamp <= after:
                return None
            start = SLOT * (place + DATA)
            payload = bytes(self._bytes[start : start + length])
            if words[place + MARK] == number and _check(number, stamp, payload) == check:
                return Arrival(stamp, payload)
        return None

    def _place(self, number: int) -> int:
        return HEAD + number % self._count * self._width


def _check(number: int, stamp: int, payload: bytes) -> int:
    """Return the checksum of a record, which is another one for the record that was in its place before."""
    return zlib.crc32(payload, zlib.crc32(_CHECKED.pack(number, stamp, len(payload))))
