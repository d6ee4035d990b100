"""A hash of an array of numbers, the same interpreted and compiled."""

from __future__ import annotations

import math
from typing import Any

M1, M2 = 4294967087, 4294944443  # primes
NOTHING = 0  # the digest of a value without any number
HALF = 2**26  # a mantissa has 53 bits; products with pieces below `HALF` stay exact


def digest(value: Any) -> int:
    """Return 63 bits of a polynomial hash over the bits of a scalar or an array; 0 if all of it is NaN.

    Equal numbers give equal digests (-0.0 equals 0.0, and NaN equals NaN). Two different arrays have the
    same digest with a probability of about 2**-62.
    Source: R. M. Karp and M. O. Rabin, Efficient randomized pattern-matching algorithms, IBM Journal of
    Research and Development 31(2), 1987; here with two prime moduli.
    """
    first, second, numbers = 1, 1, 0
    if isinstance(value, float):
        first, second, numbers = _mixed(value, first, second, numbers)
    else:
        for place in range(value.size):
            first, second, numbers = _mixed(value.flat[place], first, second, numbers)
    if numbers == 0:
        return NOTHING
    return first * 2**31 + second // 2 + 1


def _mixed(number: float, first: int, second: int, numbers: int) -> tuple[int, int, int]:
    """Return both remainders and the count of numbers after one more element; NaN does not count."""
    if math.isnan(number):
        high, low, power = 1, 1, 5000
    elif math.isinf(number):
        high, low, power = (2 if number > 0.0 else 3), 1, 5000
    else:
        part, power = math.frexp(number)
        whole = int(part * 2.0**53)
        high, low = whole // HALF, whole % HALF
    for piece in (high + 2 * HALF, low, power + 5000):
        first = (first * 1403580 + piece) % M1
        second = (second * 1370589 + piece) % M2
    return first, second, numbers + (0 if math.isnan(number) else 1)
