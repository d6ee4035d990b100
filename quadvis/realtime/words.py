"""Whole numbers of 8 bytes in memory that Python and machine code share."""

from __future__ import annotations

from typing import Any

import numpy as np

SLOT = 8  # bytes


def whole_words(count: int) -> memoryview[int]:
    """Return words of 0."""
    return memoryview(bytearray(SLOT * count)).cast("q")


def address_of(words: Any) -> int:
    """Return the address of words."""
    return int(np.frombuffer(words, np.int64).ctypes.data)
