"""Packets of MAVLink 2: what is on the wire around a payload.

0xFD, length, two bytes of flags, sequence number, system, component, number of the message (3), payload,
checksum (2), and if the first flag says so a signature (13); little-endian. The checksum is CRC-16/MCRF4XX
over all but the first byte, and over a byte that the fields of the message give. See
https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Iterable, Iterator
from typing import NamedTuple

MAGIC, MAGIC_1 = 0xFD, 0xFE  # the first byte of a packet; that of MAVLink 1
SIGNED = 0x01  # the one flag that a receiver must understand
HEAD, CHECK, SIGNATURE = struct.Struct("<BBBBBBBHB"), struct.Struct("<H"), 13
LEAST = HEAD.size + CHECK.size
LARGEST = 255  # bytes of a payload
LONGEST = LEAST + LARGEST + SIGNATURE

# crc_hqx is the same checksum with the bits of all bytes turned round, and runs as machine code.
_MIRRORED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_LOOSE = struct.Struct("<HBBB")


class LooseMessage(NamedTuple):
    """A message that is no packet yet: its number, the byte that its checksum takes in, its payload."""

    number: int
    extra: int
    payload: bytes


def checksum(data: bytes) -> int:
    """Return CRC-16/MCRF4XX."""
    turned = crc_hqx(data.translate(_MIRRORED), 0xFFFF)
    return _MIRRORED[turned & 0xFF] << 8 | _MIRRORED[turned >> 8]


def packet(message: LooseMessage, sequence: int, system: int, component: int, flags: int = 0) -> bytes:
    """Return the packet of a message, without a signature."""
    number, extra, payload = message
    head = HEAD.pack(
        MAGIC, len(payload), flags, 0, sequence, system, component, number & 0xFFFF, number >> 16
    )
    body = head + payload
    return body + CHECK.pack(checksum(body[1:] + bytes([extra])))


def implied_extra(body: bytes, check: int) -> int | None:
    """Return the byte with which the bytes between magic and checksum have this checksum; None if no byte."""
    before = checksum(body)
    index = _INDEX.get(check ^ before >> 8)
    return None if index is None else index ^ before & 0xFF


def _step(index: int) -> int:
    """Return what a byte does to the checksum, in the table-driven form of a reflected CRC."""
    for _ in range(8):
        index = index >> 1 ^ (0x8408 if index & 1 else 0)
    return index


_INDEX = {_step(index): index for index in range(256)}


def loosened(messages: Iterable[LooseMessage]) -> bytes:
    """Return messages as bytes: what goes to the process that makes packets of them."""
    return b"".join(
        _LOOSE.pack(number & 0xFFFF, number >> 16, extra, len(payload)) + payload
        for number, extra, payload in messages
    )


def loose_messages(data: bytes) -> Iterator[LooseMessage]:
    """Yield the messages that `loosened` has made bytes of; struct.error if it has not."""
    at = 0
    while at < len(data):
        low, high, extra, length = _LOOSE.unpack_from(data, at)
        at += _LOOSE.size
        yield LooseMessage(low | high << 16, extra, data[at : at + length])
        at += length
