"""Futaba SBUS: 16 channels of 11 bits in a frame of 25 bytes, at 100000 baud 8E2, inverted on the wire.

A frame is 0x0F, 22 bytes with the channels, the lowest bit of each first, one byte of flags, and 0x00; SBUS2
ends in 0x04, 0x14, 0x24 or 0x34. There is no checksum. See https://github.com/bolderflight/sbus and PX4's
``src/lib/rc/sbus.cpp``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from quadvis.block import Line, ParameterError

START, ENDS = 0x0F, (0x00, 0x04, 0x14, 0x24, 0x34)
LENGTH, CHANNELS, BITS = 25, 16, 11
FRAME_LOST, FAILSAFE = 0x04, 0x08
FLAGS = 0x0F  # all flags that are known
LOW, HIGH = 172, 1811  # counts of the ends of a stick
SPAN = HIGH - LOW
MARGIN = 0.05 * SPAN  # beyond the ends; a channel farther out was spoilt on its way
LINE = Line(100_000, parity="even", stop_bits=2, gap=3e-3)


class Channels(NamedTuple):
    """The counts (0 to 2047) and the flags of a frame."""

    counts: list[int]
    flags: int


def encode(counts: Sequence[int], flags: int = 0) -> bytes:
    """Return the frame of 16 counts."""
    packed = sum(int(count) << BITS * number for number, count in enumerate(counts))
    return bytes([START, *packed.to_bytes(LENGTH - 3, "little"), flags, ENDS[0]])


def decode(frame: Sequence[int]) -> Channels | None:
    """Return what a frame says; None if it is none."""
    if frame[0] != START or frame[-1] not in ENDS or frame[-2] & ~FLAGS:
        return None
    packed = int.from_bytes(bytes(frame[1:-2]), "little")
    mask = (1 << BITS) - 1
    return Channels([packed >> BITS * number & mask for number in range(CHANNELS)], frame[-2])


def shares(command: Any, lowest: Any, highest: Any) -> Any:
    """Return how far each command is from ``lowest`` (0) to ``highest`` (1); either may be greater."""
    return np.clip((command - lowest) / (highest - lowest), 0.0, 1.0)


def check_channels(channels: Any, lowest: Any, highest: Any) -> None:
    """Refuse channels that are named twice, and ranges without a length."""
    if len(np.unique(channels)) < len(channels):
        raise ParameterError("channels", "channels must be different from each other")
    if (np.equal(lowest, highest)).any():
        raise ParameterError("highest", "highest must be different from lowest, element by element")
