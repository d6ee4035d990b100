"""Values of channels as frames: what a board at a serial line takes and gives, and what goes to a driver.

A frame is COBS(kind u8, then for each channel its number u8 and its value i32, then CRC-32 u32) and a zero
byte, all little-endian; CRC and COBS are those of `quadvis.links.frame`. Kinds are "A", levels in 1e-6 V or
1e-6 A, "D", digital lines as 0 or 1, and "C", counts that wrap. Channels are numbered from 1. Both ways are
alike: to a board such a frame is what it must put out, from a board what it has measured.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping
from enum import Enum
from typing import NamedTuple

from quadvis.links.frame import END, stuffed, unstuffed

ENTRY, CHECK = struct.Struct("<Bi"), struct.Struct("<I")
MOST = 255  # the greatest number of a channel
LONGEST = 1 + MOST * ENTRY.size + CHECK.size + 8  # bytes of a frame, with what COBS adds and its end
MICRO = 1_000_000
WORD = 1 << 32


class ChannelKind(Enum):
    """What the values of a frame are."""

    ANALOG = ord("A")
    DIGITAL = ord("D")
    COUNTS = ord("C")


class ChannelValues(NamedTuple):
    """A whole frame: its kind, and its values by channel."""

    kind: ChannelKind
    values: Mapping[int, int]


def encode(kind: ChannelKind, values: Iterable[tuple[int, int]]) -> bytes:
    """Return the frame of channels and their values."""
    body = bytes([kind.value]) + b"".join(ENTRY.pack(channel, _signed(value)) for channel, value in values)
    return stuffed(body + CHECK.pack(zlib.crc32(body))) + END


def decode(piece: bytes) -> ChannelValues | None:
    """Return what stood before the end of a frame; None if that is not a whole frame."""
    try:
        body = unstuffed(piece)
        kind = ChannelKind(body[0])
    except (ValueError, IndexError):
        return None
    inside = len(body) - CHECK.size
    if (
        inside < 1
        or (inside - 1) % ENTRY.size
        or zlib.crc32(body[:inside]) != CHECK.unpack_from(body, inside)[0]
    ):
        return None
    return ChannelValues(kind, dict(ENTRY.iter_unpack(body[1:inside])))


def take(received: bytearray) -> Iterator[ChannelValues | None]:
    """Take all frames that end in these bytes; yield each, or None for one that is not whole."""
    while (end := received.find(END)) >= 0:
        piece = bytes(received[:end])
        del received[: end + 1]
        if piece:
            yield decode(piece)
    if len(received) > LONGEST:
        received.clear()
        yield None


def _signed(value: int) -> int:
    """Return a value as 32 bits have it."""
    return (value + WORD // 2) % WORD - WORD // 2
