"""A ring of records between two processes: one puts, the other takes, and neither waits for the other."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.native.routine import Routine

SLOT = 8
PUT, TAKEN, LOST = range(3)  # numbers of records: put and lost by the producer, taken by the consumer
HEAD = 8  # words before the records: a line of the processor's cache

# Whether a processor lets others see what it has written in the order in which it wrote, as x86 does:
# Intel 64 and IA-32 Architectures Software Developer's Manual, volume 3A, section 8.2.2.
IN_ORDER = platform.machine().lower() in ("x86_64", "amd64")

Words = NDArray[np.int64]


class RecordRing:
    """Records of ``width`` words, a whole number and then slots; at most ``room`` records wait.

    Both processes make one over the same words, which are 0 at the beginning. If the ring is full, a new
    record is lost and counted.
    """

    def __init__(self, words: Any, room: int, width: int) -> None:
        self.words, self._bytes = words, words.cast("B")
        self._room, self._width = room, width
        self._records = np.frombuffer(words, np.int64)[HEAD:].reshape(room, width)
        self._taken = self._seen = 0

    @staticmethod
    def size(room: int, width: int) -> int:
        """Return the number of words of a ring."""
        return HEAD + room * width

    @property
    def lost(self) -> int:
        """How many records found no room."""
        return int(self.words[LOST])

    def put(self, number: int, raw: memoryview, pieces: Sequence[slice]) -> None:
        """Add a record: a number, and pieces of bytes one after another, which fill its other words."""
        words = self.words
        at = place_in(words, 0, self._room, self._width)
        if at < 0:
            return
        words[at] = number
        start = SLOT * (at + 1)
        for piece in pieces:
            end = start + piece.stop - piece.start
            self._bytes[start:end] = raw[piece]
            start = end
        words[PUT] += 1

    def machine(self, memory: int, pieces: Sequence[slice]) -> tuple[int, ...]:
        """Return the addresses that the machine code of `put` takes; ``memory`` is that of the pieces."""
        self._pieces = np.array(
            [self._room, self._width, len(pieces)]
            + [
                number
                for piece in pieces
                for number in (piece.start // SLOT, (piece.stop - piece.start) // SLOT)
            ],
            np.int64,
        )
        words = np.frombuffer(self.words, np.int64)
        return words.ctypes.data, memory, self._pieces.ctypes.data

    def take(self, *, last: bool = False) -> Words:
        """Return the records (N, width) that are there.

        Some processors let another one see the number of records before their words; by the next call these
        have surely come through. There it gives those that were there at the last call already, or all with
        ``last``, and then the producer must have ended.
        """
        present = int(self.words[PUT])
        until, self._seen = (present if last or IN_ORDER else self._seen), present
        places = np.arange(self._taken, until) % self._room
        found = self._records[places]
        self._taken = self.words[TAKEN] = until
        return found

    def kept(self) -> Words:
        """Return the newest records (N, width) that are still there, taken or not, for who has put them."""
        present = int(self.words[PUT])
        return self._records[np.arange(max(0, present - self._room), present) % self._room]


def place_in(words: Any, start: int, room: int, width: int) -> Any:
    """Return where the next record of the ring at ``start`` begins; -1 if it is full, which is counted."""
    done = words[start + PUT]
    if done - words[start + TAKEN] >= room:
        words[start + LOST] += 1
        return -1
    return start + HEAD + done % room * width


def put(number: Any, words: Any, memory: Any, pieces: Any) -> None:
    """Do as `RecordRing.put`, as machine code; ``pieces``: room, width, how many, first and size of each."""
    room, width, count = pieces[0], pieces[1], pieces[2]
    at = place_in(words, 0, room, width)
    if at < 0:
        return
    words[at] = number[0]
    at += 1
    for piece in range(count):
        first = pieces[3 + 2 * piece]
        for index in range(pieces[4 + 2 * piece]):
            words[at + index] = memory[first + index]
        at += pieces[4 + 2 * piece]
    words[PUT] += 1


PUTTING = Routine(put, "wwww")
