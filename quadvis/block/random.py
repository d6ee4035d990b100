"""Random numbers that are the same interpreted and compiled: L'Ecuyer's MRG32k3a.

A block draws from its `Random()` states, in ``start`` and ``update`` only.

A stream is its state, int64[6]: three numbers below ``M1`` (not all zero), then three below ``M2`` (not all
zero). All products stay below 2**53, so int64 arithmetic is exact everywhere.
Source: P. L'Ecuyer, Good parameters and implementations for combined multiple recursive random number
generators, Operations Research 47(1), 1999, figure I. Period about 2**191.
"""

from __future__ import annotations

import hashlib
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Stream = NDArray[np.int64]

M1 = 4294967087
M2 = 4294944443
SCALE = 1.0 / (M1 + 1)


def stream_start(seed: int, name: str) -> list[int]:
    """Return the initial state of a stream: a hash of seed and name, so no stream depends on another."""
    digest = hashlib.sha256(f"{seed}/{name}".encode()).digest()
    count = min(M1, M2) - 1  # the numbers from 1 to `count` are valid in both halves of a stream
    return [1 + int.from_bytes(digest[4 * i : 4 * i + 4], "little") % count for i in range(6)]


def uniform(stream: Stream) -> float:
    """Return a number in the open interval (0, 1) and advance the stream in place."""
    first = (1403580 * int(stream[1]) - 810728 * int(stream[0])) % M1
    stream[0] = stream[1]
    stream[1] = stream[2]
    stream[2] = first
    second = (527612 * int(stream[5]) - 1370589 * int(stream[3])) % M2
    stream[3] = stream[4]
    stream[4] = stream[5]
    stream[5] = second
    difference = first - second
    if difference <= 0:
        difference += M1
    return difference * SCALE


def normal(stream: Stream) -> float:
    """Return a standard normal number and advance the stream by two uniforms (Box-Muller, cosine half)."""
    radius = math.sqrt(-2.0 * math.log(uniform(stream)))
    return radius * math.cos(2.0 * math.pi * uniform(stream))


def fill_uniform(stream: Stream, numbers: Any) -> None:
    """Fill a one-dimensional array with the numbers that `uniform` would return one after the other."""
    # Interpreted, reading and writing the stream takes most of the time of `uniform`.
    a, b, c = int(stream[0]), int(stream[1]), int(stream[2])
    d, e, f = int(stream[3]), int(stream[4]), int(stream[5])
    for index in range(numbers.size):
        a, b, c = b, c, (1403580 * b - 810728 * a) % M1
        d, e, f = e, f, (527612 * f - 1370589 * d) % M2
        difference = c - f
        if difference <= 0:
            difference += M1
        numbers[index] = difference * SCALE
    stream[0], stream[1], stream[2] = a, b, c
    stream[3], stream[4], stream[5] = d, e, f


def fill_normal(stream: Stream, numbers: Any) -> None:
    """Fill a one-dimensional array with independent standard normal numbers, in pairs (Box-Muller)."""
    chances = np.empty(numbers.size + numbers.size % 2)
    fill_uniform(stream, chances)
    for index in range(0, numbers.size, 2):
        radius = math.sqrt(-2.0 * math.log(chances[index]))
        angle = 2.0 * math.pi * chances[index + 1]
        numbers[index] = radius * math.cos(angle)
        if index + 1 < numbers.size:
            numbers[index + 1] = radius * math.sin(angle)


def random_signs(stream: Stream, numbers: Any) -> None:
    """Fill a one-dimensional array with -1 and 1, each with probability one half."""
    for index in range(numbers.size):
        numbers[index] = -1.0 if uniform(stream) < 0.5 else 1.0


def normal_like(stream: Stream, like: Any) -> Any:
    """Return independent standard normal numbers, as many as ``like`` (a float or an array) has elements."""
    if isinstance(like, float):
        return normal(stream)
    numbers = np.empty_like(like)
    fill_normal(stream, numbers.reshape(-1))
    return numbers
