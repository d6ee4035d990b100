"""Read the records of an MCAP file that may be cut, damaged or hostile: everything is checked before use.

A record is a byte (its kind), its length in eight bytes, and its contents; a chunk holds records. Where a
record contradicts its own numbers, the reader searches for the next sound record. It compares lengths with
the data before it copies anything, and does not unpack data that would become much larger than a log.

Format: https://mcap.dev/spec
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

from quadvis.output.mcap_chunks import CHUNK_HEAD, packing_of, unpacked

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(0x01, 0x09)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(
    0x09, 0x10
)
LAST, PRIVATE = DATA_END, 0x80
HEAD = struct.Struct("<BQ")
FREE, RATIO = 4 << 20, 64  # bytes that any file may unpack to, plus a multiple of its size

# Records that can be recognised in the middle of other data: chunks, and the first and last records of a log.
KNOWN = re.compile(
    rb"\x06.{5}\0{3}.{28}(?:\0{4}|\x03\0{3}lz4|\x04\0{3}zstd)"
    rb"|\x0c.{5}\0{3}\x07\0{3}(?:quadvis|summary|changes)"
    rb"|\x09.{5}\0{3}.{16}\x0c\0{3}diagram\.yaml"
    rb"|\x0f\x04\0{7}.{4}",
    re.DOTALL,
)


class BrokenError(ValueError):
    """A record contradicts its own numbers."""


@dataclass(frozen=True)
class AttachmentRecord:
    """A file inside the log: its name and contents."""

    name: str
    data: bytes


@dataclass(frozen=True)
class MetadataRecord:
    """Names and texts about the run, under a common name."""

    name: str
    entries: dict[str, str]


@dataclass(frozen=True)
class SchemaRecord:
    """The type of the messages of channels: its name, the language of its definition, the definition."""

    number: int
    name: str
    language: str
    definition: str


@dataclass(frozen=True)
class ChannelRecord:
    """The description of all messages with one number: their topic, further entries, type and encoding."""

    number: int
    topic: str
    entries: dict[str, str]
    schema: int = 0
    encoding: str = ""


@dataclass(frozen=True, slots=True)
class MessageRecord:
    """One row: the channel's number, the time (ns), and the bytes."""

    channel: int
    time: int
    data: bytes


Record = AttachmentRecord | MetadataRecord | SchemaRecord | ChannelRecord | MessageRecord


class RecordScan:
    """Reads a file once; then ``damaged`` counts the parts left out, ``ended`` says if it has its end.

    ``whole`` is true if the part with the rows is complete.
    """

    def __init__(self, data: bytes) -> None:
        """Begin with the contents of a file that starts with `MAGIC`."""
        self.data = memoryview(data)
        self.damaged = 0
        self.ended = self.whole = False
        self._left = FREE + RATIO * len(data)

    def records(self) -> Iterator[Record]:
        """Yield the records of a log, in the order of the file."""
        position = len(MAGIC)
        while not self.ended:
            try:
                kind, end = self._frame(position)
                body = self.data[position + HEAD.size : end]
                _check(kind, body)
                found = list(_inside(self._contents(body)) if kind == CHUNK else _read(kind, body))
            except BrokenError:
                following = self._next(position + 1)
                if following is None:
                    yield from self._cut_chunk(position)
                    return
                self.damaged += 1
                position = following
                continue
            position = end
            if kind == FOOTER:
                self.ended = self._is_end(body, end)
                return
            self.whole |= kind == DATA_END
            yield from found

    def _frame(self, position: int) -> tuple[int, int]:
        """Return the kind of the record at a position, and the position of its end."""
        if position + HEAD.size > len(self.data):
            raise BrokenError
        kind, length = HEAD.unpack_from(self.data, position)
        end = position + HEAD.size + length
        if not (1 <= kind <= LAST or kind >= PRIVATE) or end > len(self.data):
            raise BrokenError
        return kind, end

    def _next(self, position: int) -> int | None:
        """Return the position of the next unmistakable record."""
        for found in KNOWN.finditer(self.data, position):
            try:
                kind, end = self._frame(found.start())
                _check(kind, self.data[found.start() + HEAD.size : end])
            except BrokenError:
                continue
            return found.start()
        return None

    def _is_end(self, footer: memoryview, end: int) -> bool:
        """Return whether the file ends here with a sound index."""
        start, _, crc = struct.unpack("<QQI", footer)
        index = self.data[start : end - 4] if start else b""
        return bytes(self.data[end : end + len(MAGIC)]) == MAGIC and (not crc or zlib.crc32(index) == crc)

    def _contents(self, body: memoryview) -> memoryview:
        """Return the records of a chunk, unpacked; BrokenError if they are damaged or too large."""
        size, crc = CHUNK_HEAD.unpack_from(body)[2:4]
        data = self._unpacked(body)
        if data is None or len(data) != size or (crc and zlib.crc32(data) != crc):
            raise BrokenError
        return memoryview(data)

    def _cut_chunk(self, position: int) -> Iterator[Record]:
        """Yield the first records of a chunk that is cut off by the end of the file."""
        body = self.data[position + HEAD.size :]
        if self.data[position : position + 1] != bytes([CHUNK]) or len(body) < CHUNK_HEAD.size:
            return
        if HEAD.unpack_from(self.data, position)[1] <= len(body):
            return  # the chunk is complete but damaged
        packing = packing_of(body)
        if packing is None or len(body) < CHUNK_HEAD.size + len(packing) + 8:
            return
        try:
            yield from _inside(memoryview(self._unpacked(body) or b""))
        except BrokenError:
            return  # the file ends here

    def _unpacked(self, body: memoryview) -> bytes | memoryview | None:
        """Return the contents of a chunk, as far as they exist; None if they are damaged or too large."""
        size, packing = CHUNK_HEAD.unpack_from(body)[2], packing_of(body)
        packed = body[CHUNK_HEAD.size + len(packing or "") + 8 :]
        if not packing:
            return packed
        if size > self._left:
            return None
        self._left -= size
        return unpacked(packing, packed, size)


def _check(kind: int, body: memoryview) -> None:
    """Raise BrokenError if the lengths inside a record contradict the length of the record."""
    if kind == CHUNK:
        packing = packing_of(body) if len(body) >= CHUNK_HEAD.size else None
        start = CHUNK_HEAD.size + len(packing or "")
        if packing is None or len(body) < start + 8:
            raise BrokenError
        if int.from_bytes(body[start : start + 8], "little") != len(body) - start - 8:
            raise BrokenError
    elif kind == MESSAGE_INDEX:
        if len(body) < 6 or int.from_bytes(body[2:6], "little") != len(body) - 6:
            raise BrokenError
    elif kind == FOOTER:
        if len(body) != 20:
            raise BrokenError
    elif kind == ATTACHMENT:
        for _ in _read(kind, body):
            pass
        if (crc := int.from_bytes(body[-4:], "little")) and zlib.crc32(body[:-4]) != crc:
            raise BrokenError
    else:
        for _ in _read(kind, body):
            pass


def _inside(data: memoryview) -> Iterator[Record]:
    """Yield the records of a chunk's contents; BrokenError at an incomplete record."""
    position = 0
    while position < len(data):
        if position + HEAD.size > len(data):
            raise BrokenError
        kind, length = HEAD.unpack_from(data, position)
        start = position + HEAD.size
        position = start + length
        if position > len(data):
            raise BrokenError
        yield from _read(kind, data[start:position])


def _read(kind: int, body: memoryview) -> Iterator[Record]:
    """Yield the record if a log needs this kind; BrokenError if it contradicts itself."""
    if kind == MESSAGE:
        if len(body) < 22:
            raise BrokenError
        channel, _, time = struct.unpack_from("<HIQ", body)
        yield MessageRecord(channel, time, bytes(body[22:]))
    elif kind == CHANNEL:
        number, schema = struct.unpack("<HH", _slice(body, 0, 4))
        topic, place = _text(body, 4)
        encoding, place = _text(body, place)
        yield ChannelRecord(number, topic, _entries(body, place), schema, encoding)
    elif kind == SCHEMA:
        number = int.from_bytes(_slice(body, 0, 2), "little")
        name, place = _text(body, 2)
        language, place = _text(body, place)
        definition = bytes(body[place + 4 :]).decode(errors="replace")  # some are no texts, and not read
        yield SchemaRecord(number, name, language, definition)
    elif kind == METADATA:
        name, place = _text(body, 0)
        yield MetadataRecord(name, _entries(body, place))
    elif kind == ATTACHMENT:
        name, place = _text(body, 16)
        _, place = _text(body, place)
        length = int.from_bytes(_slice(body, place, 8), "little")
        if place + 8 + length + 4 != len(body):
            raise BrokenError
        yield AttachmentRecord(name, bytes(body[place + 8 : place + 8 + length]))


def _slice(body: memoryview, start: int, length: int) -> memoryview:
    if start + length > len(body):
        raise BrokenError
    return body[start : start + length]


def _text(body: memoryview, place: int) -> tuple[str, int]:
    """Return a text that follows its own length, and the position of its end."""
    length = int.from_bytes(_slice(body, place, 4), "little")
    try:
        return bytes(_slice(body, place + 4, length)).decode(), place + 4 + length
    except UnicodeDecodeError:
        raise BrokenError from None


def _entries(body: memoryview, place: int) -> dict[str, str]:
    """Return the pairs of texts that fill the rest of a record."""
    length = int.from_bytes(_slice(body, place, 4), "little")
    place += 4
    if place + length != len(body):
        raise BrokenError
    found = {}
    while place < len(body):
        key, place = _text(body, place)
        found[key], place = _text(body, place)
    return found
