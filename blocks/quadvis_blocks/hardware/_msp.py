"""MSP, the protocol of Betaflight, iNav and other flight controllers: requests, answers, commands.

Version 1 is ``$M<``, the count of bytes, the number of the command, the bytes, and the xor of all from the
count on. Version 2 is ``$X<``, a flag, the command (u16), the count (u16), the bytes, and CRC-8/DVB-S2 from
the flag on. An answer has ``>`` in place of ``<``, or ``!`` if the controller does not know the command. All
numbers are little-endian. Sources: https://github.com/iNavFlight/inav/wiki/MSP-V2 and Betaflight's
``src/main/msp``.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

from quadvis_blocks.hardware._protocol.checksums import algorithm, xor

VARIANT, MODE_RANGES = 2, 34
STATUS, RAW_IMU, ATTITUDE, ANALOG = 101, 102, 108, 110
BOX_IDS, STATUS_EX, SET_RAW_RC = 119, 150, 200
V1, V2 = 1, 2
REQUEST, ANSWER, REFUSAL = b"<>!"
HEADS = {b"$M": V1, b"$X": V2}
LONGEST = 255  # bytes that one message carries; a longer one is not among those that are asked for
_HEAD_V2 = struct.Struct("<BHH")
_crc = algorithm("crc8_dvb_s2").compute


class MspMessage(NamedTuple):
    """A message: its command, its bytes, and who speaks: ``REQUEST``, ``ANSWER`` or ``REFUSAL``."""

    command: int
    payload: bytes
    direction: int


def encode(command: int, payload: bytes = b"", *, version: int = V2, direction: int = REQUEST) -> bytes:
    """Return the bytes of a message."""
    if version == V1:
        body = bytes([len(payload), command]) + payload
        return b"$M" + bytes([direction]) + body + bytes([xor(body)])
    body = _HEAD_V2.pack(0, command, len(payload)) + payload
    return b"$X" + bytes([direction]) + body + bytes([_crc(body)])


def take(received: bytearray) -> Iterator[MspMessage | None]:
    """Take messages off the beginning of some bytes; yield None for damage.

    After damage the search goes on one byte later, inside of it.
    """
    is_spoilt = False
    while True:
        begin = received.find(b"$")
        is_spoilt |= begin > 0 or (begin < 0 and bool(received))
        del received[: len(received) if begin < 0 else begin]
        size = _size(received)
        if size < 0 or len(received) < size:
            break
        found = _message(bytes(received[:size])) if size else None
        if found is None:
            is_spoilt = True
            del received[:1]
            continue
        del received[:size]
        if is_spoilt:
            yield None
        is_spoilt = False
        yield found
    if is_spoilt:
        yield None


def _size(received: bytearray) -> int:
    """Return the bytes of the message that begins here; 0 if none does, -1 if that is not known yet."""
    head = bytes(received[:2])
    if len(head) < 2:
        return -1 if head in (b"", b"$") else 0
    if head not in HEADS:
        return 0
    if len(received) < 3:
        return -1
    if received[2] not in (REQUEST, ANSWER, REFUSAL):
        return 0
    if HEADS[head] == V1:
        return -1 if len(received) < 4 else 6 + received[3]
    if len(received) < 8:
        return -1
    count = _HEAD_V2.unpack_from(received, 3)[2]
    return 9 + count if count <= LONGEST else 0


def _message(data: bytes) -> MspMessage | None:
    """Return the message that some bytes are; None if its checksum is wrong."""
    body = data[3:-1]
    if HEADS[data[:2]] == V1:
        return MspMessage(body[1], body[2:], data[2]) if xor(body) == data[-1] else None
    command = _HEAD_V2.unpack_from(body)[1]
    return MspMessage(command, body[_HEAD_V2.size :], data[2]) if _crc(body) == data[-1] else None
