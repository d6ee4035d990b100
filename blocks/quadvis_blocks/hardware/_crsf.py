"""CRSF, the protocol of TBS Crossfire and ExpressLRS: frames with a checksum, not inverted, 8N1.

A frame is a sync byte, the number of bytes that follow (2 to 62), a type, a payload, and a CRC-8 of type and
payload (polynomial 0xD5, begun with 0). Receivers and flight controllers begin with 0xC8, some radios with
0xEE. The channels (type 0x16) are 22 bytes; link statistics (type 0x14) are 10 bytes. See the specification
of TBS, https://github.com/tbs-fpv/tbs-crsf-spec.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from enum import Enum
from typing import NamedTuple

from quadvis_blocks.hardware._counts import packed

TO_FLIGHT_CONTROLLER, TO_MODULE = 0xC8, 0xEE
SYNCS = (TO_FLIGHT_CONTROLLER, TO_MODULE)
SYNC = re.compile(rb"[\xc8\xee]")
SHORTEST, LONGEST = 2, 62  # of the byte that says the length
AROUND = 2  # bytes before those that the length counts
STATISTICS, CHANNELS = 0x14, 0x16
LENGTHS = {STATISTICS: 12, CHANNELS: 24}  # of the types that are read here, as the length byte says them
HEADS = tuple(bytes([length, kind]) for kind, length in LENGTHS.items())  # behind their sync byte
WANTED = re.compile(rb"(?=([\xc8\xee](?:\x18\x16.{23}|\x0c\x14.{11})))", re.DOTALL)
POLYNOMIAL = 0xD5
LARGEST = AROUND + LONGEST


class CrsfFrame(NamedTuple):
    """The type and the payload of a frame."""

    kind: int
    payload: bytes


class Spoilt(Enum):
    """What `CrsfDecoder.take` yields for bytes that are no frame: at most as many as a frame has."""

    SPOILT = "spoilt"


def _remainder(value: int) -> int:
    for _ in range(8):
        value = value << 1 ^ (POLYNOMIAL if value & 0x80 else 0)
    return value & 0xFF


REMAINDERS = bytes(map(_remainder, range(256)))


def checksum(piece: bytes | bytearray) -> int:
    """Return the CRC-8 of bytes."""
    crc = 0
    for byte in piece:
        crc = REMAINDERS[crc ^ byte]
    return crc


def frame_of(kind: int, payload: bytes, sync: int = TO_FLIGHT_CONTROLLER) -> bytes:
    """Return the frame of a payload."""
    body = bytes([kind]) + payload
    return bytes([sync, len(body) + 1]) + body + bytes([checksum(body)])


def encode(counts: Sequence[int], sync: int = TO_FLIGHT_CONTROLLER) -> bytes:
    """Return the frame of 16 counts."""
    return frame_of(CHANNELS, packed(counts), sync)


class CrsfDecoder:
    """Finds the channels and the link statistics in any stream of bytes.

    After bytes that are no frame the search goes on one byte later, inside what was refused. So one byte
    that is missing, added or wrong costs one frame. The checksum alone lets one damaged frame in 256 pass:
    what stands around a frame must fit, too.
    """

    def __init__(self) -> None:
        self._spoilt = 0  # bytes in a row that are no frame

    def take(self, received: bytearray) -> Iterator[CrsfFrame | Spoilt]:
        """Take all that is whole off the beginning, and leave what may still become a frame."""
        at = 0
        while at + AROUND < len(received):
            size = _size(received, at)
            if size and at + size > len(received):
                following = _wanted(received, at + 1)
                if following < 0:
                    break
            elif size and checksum(received[at + AROUND : at + size - 1]) == received[at + size - 1]:
                believed = _believed(received, at, at + size)
                if believed is None:
                    break
                if believed:
                    self._spoilt = 0
                    if received[at + AROUND] in LENGTHS:
                        payload = bytes(received[at + AROUND + 1 : at + size - 1])
                        yield CrsfFrame(received[at + AROUND], payload)
                    at += size
                    continue
                following = _next(received, at + 1)
            else:
                following = _next(received, at + 1)
            yield from self._skip(following - at)
            at = following
        del received[:at]

    def _skip(self, count: int) -> Iterator[Spoilt]:
        """Count bytes that are no frame: the first in a row, and again after each frame's worth of them."""
        before = -(-self._spoilt // LARGEST)
        self._spoilt += count
        yield from [Spoilt.SPOILT] * (-(-self._spoilt // LARGEST) - before)


def _size(received: bytearray, at: int) -> int:
    """Return how many bytes the frame that may begin here has; 0 if none can."""
    length, kind = received[at + 1], received[at + AROUND]
    if received[at] not in SYNCS or not SHORTEST <= length <= LONGEST:
        return 0
    return AROUND + length if LENGTHS.get(kind, length) == length else 0


def _next(received: bytearray, begin: int) -> int:
    """Return where the next frame may begin."""
    found = SYNC.search(received, begin)
    return found.start() if found else len(received)


def _wanted(received: bytearray, begin: int) -> int:
    """Return where a frame that is read here begins, whole and with its checksum; -1 if there is none.

    What claims to be a long frame may be the rest of a damaged one: it must not hold up what follows.
    """
    for found in WANTED.finditer(received, begin):
        if checksum(found[1][AROUND:-1]) == found[1][-1]:
            return found.start()
    return -1


def _believed(received: bytearray, begin: int, end: int) -> bool | None:
    """Return whether a frame with the right checksum is one; None if that is to be seen from what follows.

    A frame that lacks a byte has the sync byte of the next one in the place of its checksum. A frame with a
    byte too many has its own checksum behind its end. A frame of a type that is not read here is stepped over
    only if a sync byte follows.
    """
    following = bytes(received[end : end + 2])
    if following and following[0] in SYNCS:
        return True
    if received[begin + AROUND] not in LENGTHS:
        return False if following else None
    if received[end - 1] in SYNCS:
        return following not in HEADS if len(following) == 2 else None
    added = len(following) == 2 and following[1] in SYNCS
    return not (added and _has_byte_too_many(received[begin + AROUND : end], following[0]))


def _has_byte_too_many(body: bytearray, crc: int) -> bool:
    """Return whether a body has a certain checksum without one of its bytes."""
    return any(checksum(body[:place] + body[place + 1 :]) == crc for place in range(len(body)))
