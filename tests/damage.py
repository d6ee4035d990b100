"""What bad lines do to bytes: damage of many kinds, each a function of the bytes and of a generator."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np

Damage = Callable[[bytes], bytes]  # called with piece after piece of a stream
FLIP, DROP, INSERT = range(3)


def damaged(data: bytes, share: float, random: np.random.Generator, kinds: tuple[int, ...] = ()) -> bytes:
    """Return the bytes with a share of them flipped, dropped, or followed by a new one."""
    found = np.frombuffer(data, np.uint8).copy()
    hit = random.random(found.size) < share
    kind = random.choice(kinds or (FLIP, DROP, INSERT), found.size)
    flipped = hit & (kind == FLIP)
    found[flipped] ^= random.integers(1, 256, int(flipped.sum()), np.uint8)
    inserted = np.flatnonzero(hit & (kind == INSERT))
    dropped = np.flatnonzero(hit & (kind == DROP))
    keep = np.ones(found.size, bool)
    keep[dropped] = False
    whole = np.insert(found, inserted, random.integers(0, 256, inserted.size, np.uint8))
    return whole[np.insert(keep, inserted, True)].tobytes()


def spoilt(kind: int, share: float, random: np.random.Generator) -> Damage:
    """A share of the bytes is flipped, dropped, or followed by a new one: by chance and one by one."""
    return lambda data: damaged(data, share, random, (kind,))


def cut(_: bytes) -> bytes:
    """Let nothing through."""
    return b""


class Bursts:
    """Now and then a run of ``length`` bytes is noise."""

    def __init__(self, random: np.random.Generator, share: float = 0.003, length: int = 24) -> None:
        self._random, self._share, self._length = random, share, length
        self._left = 0

    def __call__(self, data: bytes) -> bytes:
        found = bytearray(data)
        for place in range(len(found)):
            if not self._left and self._random.random() < self._share:
                self._left = self._length
            if self._left:
                self._left -= 1
                found[place] = int(self._random.integers(256))
        return bytes(found)


class Again:
    """Now and then the last ``length`` bytes come once more."""

    def __init__(self, random: np.random.Generator, share: float = 0.01, length: int = 80) -> None:
        self._random, self._share = random, share
        self._last: deque[int] = deque(maxlen=length)

    def __call__(self, data: bytes) -> bytes:
        found = bytearray()
        for byte in data:
            found.append(byte)
            self._last.append(byte)
            if self._random.random() < self._share:
                found += bytes(self._last)
        return bytes(found)


class Swapped:
    """Each second run of ``length`` bytes comes before the one that it followed."""

    def __init__(self, length: int = 100) -> None:
        self._length, self._held = length, bytearray()

    def __call__(self, data: bytes) -> bytes:
        self._held += data
        found = bytearray()
        while len(self._held) >= 2 * self._length:
            found += self._held[self._length : 2 * self._length] + self._held[: self._length]
            del self._held[: 2 * self._length]
        return bytes(found)


class Parity:
    """What a line with parity makes of damage: its receiver drops the bytes whose parity is wrong.

    One flipped bit is always found; of bytes that are noise, parity finds half, ``found`` of all.
    """

    def __init__(self, damage: Damage, random: np.random.Generator, found: float = 1.0) -> None:
        self._damage, self._random, self._found = damage, random, found

    def __call__(self, data: bytes) -> bytes:
        spoilt = self._damage(data)
        assert len(spoilt) == len(data), "parity is about bytes that come"
        pairs = zip(data, spoilt, strict=True)
        return bytes(now for was, now in pairs if now == was or self._random.random() >= self._found)
