"""Futaba SBUS: 16 channels of 11 bits in a frame of 25 bytes, at 100000 baud 8E2, inverted on the wire.

A frame is 0x0F, 22 bytes with the channels, one byte of flags, and 0x00; SBUS2 ends in 0x04, 0x14, 0x24 or
0x34. There is no checksum: parity, which the port checks, the first and the last byte, the four bits of the
flags that are 0, and the range of the channels are all that shows damage. See
https://github.com/bolderflight/sbus and PX4's ``src/lib/rc/sbus.cpp``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from quadvis.block import Line
from quadvis_blocks.hardware._counts import packed, unpacked

START, ENDS = 0x0F, (0x00, 0x04, 0x14, 0x24, 0x34)
LENGTH = 25
FRAME_LOST, FAILSAFE = 0x04, 0x08
FLAGS = 0x0F  # all flags that are known
LINE = Line(100_000, parity="even", stop_bits=2, gap=3e-3)


class Channels(NamedTuple):
    """The counts (0 to 2047) and the flags of a frame."""

    counts: list[int]
    flags: int


def encode(counts: Sequence[int], flags: int = 0) -> bytes:
    """Return the frame of 16 counts."""
    return bytes([START, *packed(counts), flags, ENDS[0]])


def decode(frame: bytes | bytearray) -> Channels | None:
    """Return what a frame says; None if it is none."""
    if frame[0] != START or frame[-1] not in ENDS or frame[-2] & ~FLAGS:
        return None
    return Channels(unpacked(frame[1:-2]), frame[-2])
