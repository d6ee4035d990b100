"""Sixteen channels of 11 bits, as SBUS and CRSF carry them, and what they mean in microseconds.

A frame has the channels in 22 bytes, the lowest bit of each first. A count x is a pulse of
``(x - 992) * 5/8 + 1500`` us; a stick goes from 172 to 1811, 987.5 to 2011.875 us. See
https://github.com/bolderflight/sbus, PX4's ``src/lib/rc/sbus.cpp``, and the CRSF specification of TBS
(https://github.com/tbs-fpv/tbs-crsf-spec), "RC Channels Packed Payload".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

CHANNELS, BITS = 16, 11
PACKED = CHANNELS * BITS // 8  # bytes
MOST = (1 << BITS) - 1
LOW, CENTRE, HIGH = 172, 992, 1811  # counts of a stick
GRAIN, MIDDLE = 0.625, 1500.0  # us of a count, and of the pulse of the centre
SHORTEST, LONGEST = 987.5, 2011.875  # us of LOW and HIGH


def packed(counts: Sequence[int]) -> bytes:
    """Return the bytes of 16 counts."""
    whole = sum(int(count) << BITS * number for number, count in enumerate(counts))
    return whole.to_bytes(PACKED, "little")


def unpacked(piece: bytes | bytearray) -> list[int]:
    """Return the 16 counts in 22 bytes."""
    whole = int.from_bytes(piece, "little")
    return [whole >> BITS * number & MOST for number in range(CHANNELS)]


def count_of(width: Any) -> Any:
    """Return the counts of pulses (us) that are whole counts."""
    return np.rint((width - MIDDLE) / GRAIN + CENTRE)


def width_of(count: Any) -> Any:
    """Return the pulses (us) of counts."""
    return (count - CENTRE) * GRAIN + MIDDLE
