"""Frames: messages on a line, told apart and checked so that nothing is accepted that is not whole.

On the wire: COBS(message id u8, sequence u16, stamp i64 in ns, payload, CRC-32 u32), then a zero byte, all
little-endian. COBS takes all zeros out of the bytes, so the next zero always ends a frame: whatever is
flipped, dropped or inserted spoils the frame in which it happens, and the next one if it was the end.

Source: Cheshire and Baker, Consistent Overhead Byte Stuffing, IEEE/ACM Transactions on Networking 7(2), 1999.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

from quadvis.links.message import Message
from quadvis.machine.mailbox import Arrival

_HEAD, _CHECK = struct.Struct("<BHq"), struct.Struct("<I")
OVERHEAD = _HEAD.size + _CHECK.size
END = b"\0"
RUN = 254  # bytes without a zero that one code of COBS stands for
COUNT = 1 << 16  # sequence numbers
OVERTAKEN = 64  # by so many frames at most


def longest(message: Message) -> int:
    """Return the greatest length of a frame of a message (bytes)."""
    inside = OVERHEAD + message.size
    return inside + inside // RUN + 1 + len(END)


def encode(message: Message, sequence: int, stamp: int, payload: bytes) -> bytes:
    """Return a frame; ``sequence`` counts the frames of a link, ``stamp`` is in ns."""
    body = _HEAD.pack(message.id, sequence % COUNT, stamp) + payload
    return stuffed(body + _CHECK.pack(zlib.crc32(body, message.check))) + END


def stuffed(data: bytes) -> bytes:
    """Return bytes without zeros (COBS)."""
    found = bytearray()
    for piece in data.split(END):
        while len(piece) >= RUN:
            found.append(RUN + 1)
            found += piece[:RUN]
            piece = piece[RUN:]
        found.append(len(piece) + 1)
        found += piece
    return bytes(found)


def unstuffed(data: bytes) -> bytes:
    """Return what `stuffed` has made these bytes of; ValueError if it has not."""
    found: list[bytes] = []
    place, size = 0, len(data)
    while place < size:
        code = data[place]
        end = place + code
        if not code or end > size:
            raise ValueError("these bytes are not stuffed")
        found.append(data[place + 1 : end])
        if code <= RUN and end < size:
            found.append(END)
        place = end
    return b"".join(found)


class Decoder:
    """Finds the whole frames of a message in a stream of bytes that comes in pieces of any length.

    ``refused`` counts what stood between two ends of frames and was not a whole frame. ``lost`` counts the
    frames that did not come whole, by the sequence numbers of those that did, refused ones among them. A
    frame that others have overtaken is ignored; one whose number and stamp lie far back is that of a sender
    which has begun anew.
    """

    def __init__(self, message: Message) -> None:
        self._message, self._most = message, longest(message)
        self._rest = b""
        self._overlong = False
        self._sequence, self._stamp = -1, -1
        self.refused = self.lost = 0

    def take(self, data: bytes) -> Iterator[Arrival]:
        """Yield the frames that end in these bytes."""
        *pieces, rest = (self._rest + data).split(END)
        for piece in pieces:
            overlong, self._overlong = self._overlong, False
            if piece or overlong:
                found = None if overlong else self._whole(piece)
                if found is None:
                    self.refused += 1
                elif self._is_later(*found):
                    yield found[1]
        if len(rest) > self._most:
            rest, self._overlong = b"", True
        self._rest = rest

    def _whole(self, piece: bytes) -> tuple[int, Arrival] | None:
        """Return the sequence number and the contents of a frame; None if it is not whole."""
        if len(piece) >= self._most:
            return None
        try:
            body = unstuffed(piece)
        except ValueError:
            return None
        inside = len(body) - _CHECK.size
        if inside - _HEAD.size != self._message.size:
            return None
        number, sequence, stamp = _HEAD.unpack_from(body)
        if number != self._message.id:
            return None
        if zlib.crc32(body[:inside], self._message.check) != _CHECK.unpack_from(body, inside)[0]:
            return None
        return sequence, Arrival(stamp, body[_HEAD.size : inside])

    def _is_later(self, sequence: int, arrival: Arrival) -> bool:
        ahead = (sequence - self._sequence) % COUNT
        is_later = arrival.stamp > self._stamp
        if not is_later and (ahead == 0 or ahead >= COUNT - OVERTAKEN):
            return False
        if is_later and ahead < COUNT // 2:
            self.lost += max(0, ahead - 1)
        self._sequence, self._stamp = sequence, arrival.stamp
        return True
