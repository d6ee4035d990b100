"""An outbox in shared memory: one process puts frames, another takes the newest whole one; nobody waits."""

from __future__ import annotations

import zlib
from typing import Any

from quadvis.block.device import LONGEST

SLOT = 8
PUT = 0  # by the writer: the number of frames that are whole
HEAD = 1  # words before the buffers
BUFFERS = 3  # so that the newest frame stays while the next one is written
LENGTH, CHECK, BYTES = range(3)  # words of a buffer
ROOM = BYTES + LONGEST // SLOT


class Outbox:
    """Holds the newest frame. Both processes make one over the same words, which are 0 at the beginning.

    A frame counts from the moment when its number is written, so a writer that is killed in the middle leaves
    the frame before. The checksum is for processors on which another one may see the number before the bytes.
    """

    SIZE = HEAD + BUFFERS * ROOM

    def __init__(self, words: Any) -> None:
        self._words, self._bytes = words, words.cast("B")
        self._taken = 0

    def put(self, frame: bytes) -> None:
        """Put a frame of at most ``LONGEST`` bytes."""
        number = self._words[PUT] + 1
        at = _buffer(number)
        self._words[at + LENGTH], self._words[at + CHECK] = len(frame), _check(frame, number)
        start = SLOT * (at + BYTES)
        self._bytes[start : start + len(frame)] = frame
        self._words[PUT] = number

    def take(self) -> bytes | None:
        """Return the newest frame; None if there is none that was not taken before."""
        number = self._words[PUT]
        if number == self._taken:
            return None
        at = _buffer(number)
        length, check = self._words[at + LENGTH], self._words[at + CHECK]
        start = SLOT * (at + BYTES)
        frame = bytes(self._bytes[start : start + min(max(length, 0), LONGEST)])
        if _check(frame, number) != check:  # not whole yet, or overwritten meanwhile: the next look finds it
            return None
        self._taken = number
        return frame


def _check(frame: bytes, number: int) -> int:
    """Return the checksum of a frame, which is another one for the frame that was in its place before."""
    return zlib.crc32(frame, number & 0xFFFFFFFF)


def _buffer(number: int) -> int:
    return HEAD + number % BUFFERS * ROOM
