"""Write an MCAP file: its records, chunks of messages, and at the end the indexes.

Format: https://mcap.dev/spec
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Mapping
from typing import Protocol

from quadvis.output.mcap_chunks import CHUNK_HEAD
from quadvis.output.mcap_messages import MessageChunk
from quadvis.output.mcap_records import (
    ATTACHMENT,
    ATTACHMENT_INDEX,
    CHANNEL,
    CHUNK,
    CHUNK_INDEX,
    DATA_END,
    FOOTER,
    HEAD,
    HEADER,
    MAGIC,
    MESSAGE_INDEX,
    METADATA,
    METADATA_INDEX,
    SCHEMA,
    STATISTICS,
    SUMMARY_OFFSET,
)

GROUPS = (SCHEMA, CHANNEL, STATISTICS, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX)  # of the summary
COUNTED = (SCHEMA, CHANNEL, ATTACHMENT_INDEX, METADATA_INDEX, CHUNK_INDEX)  # in the order of the statistics


class Stream(Protocol):
    """Takes the bytes of a file."""

    def write(self, data: bytes | memoryview, /) -> int:
        """Take bytes."""

    def tell(self) -> int:
        """Return the number of bytes taken so far."""


class McapWriter:
    """Writes an MCAP file whose channels are described before its first chunk, and repeated at the end.

    Schemas and channels stand in the first chunk, where its CRC covers them.
    """

    def __init__(self, stream: Stream, profile: str, library: str) -> None:
        """Begin the file."""
        self._stream = stream
        self._summary = {kind: bytearray() for kind in GROUPS}
        self._counts: Counter[int] = Counter()  # of records, by kind
        self._messages: Counter[int] = Counter()  # by channel
        self._first = self._last = 0  # stamps (ns) of messages
        stream.write(MAGIC)
        self._put(HEADER, _text(profile) + _text(library))

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Write a file into the file."""
        times, names = bytes(16), _text(name) + _text(media_type)
        body = times + names + struct.pack("<Q", len(data)) + data
        place, length = self._put(ATTACHMENT, body + struct.pack("<I", zlib.crc32(body)))
        index = struct.pack("<QQ", place, length) + times + struct.pack("<Q", len(data)) + names
        self._add(ATTACHMENT_INDEX, index)

    def add_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Write texts under a common name."""
        place, length = self._put(METADATA, _text(name) + _entries(entries))
        self._add(METADATA_INDEX, struct.pack("<QQ", place, length) + _text(name))

    def add_channel(self, topic: str, schema: str, definition: str, entries: Mapping[str, str]) -> int:
        """Describe a channel of CDR messages with a `ros2msg` definition; return its number."""
        number = self._counts[CHANNEL] + 1
        self._add(SCHEMA, struct.pack("<H", number) + _text(schema) + _text("ros2msg") + _text(definition))
        self._add(
            CHANNEL, struct.pack("<HH", number, number) + _text(topic) + _text("cdr") + _entries(entries)
        )
        return number

    @property
    def head(self) -> bytes:
        """What the next chunk has to begin with: the description of all channels, if it is the first one."""
        return b"" if self._counts[CHUNK_INDEX] else bytes(self._summary[SCHEMA] + self._summary[CHANNEL])

    def add_chunk(self, chunk: MessageChunk) -> None:
        """Write a chunk and the indexes of its messages."""
        size = len(chunk.data)
        about = CHUNK_HEAD.pack(chunk.first, chunk.last, size, zlib.crc32(chunk.data), 0)
        start = self._stream.tell()
        self._stream.write(HEAD.pack(CHUNK, len(about) + 8 + size) + about + struct.pack("<Q", size))
        self._stream.write(chunk.data)
        behind = self._stream.tell()
        places = {}
        for channel, index in chunk.indexes.items():
            body = struct.pack("<HI", channel, index.nbytes) + index.tobytes()
            places[channel], _ = self._put(MESSAGE_INDEX, body)
        indexes = self._stream.tell() - behind
        self._add(
            CHUNK_INDEX,
            struct.pack("<QQQQ", chunk.first, chunk.last, start, behind - start)
            + _numbers(places)
            + struct.pack("<QIQQ", indexes, 0, size, size),
        )
        self._first = min(self._first, chunk.first) if self._messages else chunk.first
        self._last = max(self._last, chunk.last)
        self._messages.update({channel: len(index) for channel, index in chunk.indexes.items()})

    def end(self) -> None:
        """Write the end of the file: the summary, where its groups begin, and the footer."""
        self._put(DATA_END, bytes(4))
        counts = [self._counts[kind] for kind in COUNTED]
        about = struct.pack("<QHIIIIQQ", self._messages.total(), *counts, self._first, self._last)
        self._add(STATISTICS, about + _numbers(self._messages))
        start = place = self._stream.tell()
        summary, offsets = bytearray(), bytearray()
        for kind, records in self._summary.items():
            if records:
                summary += records
                offsets += _record(SUMMARY_OFFSET, struct.pack("<BQQ", kind, place, len(records)))
                place += len(records)
        footer = HEAD.pack(FOOTER, 20) + struct.pack("<QQ", start, place)
        end = summary + offsets + footer
        self._stream.write(bytes(end) + struct.pack("<I", zlib.crc32(end)) + MAGIC)

    def _put(self, kind: int, body: bytes) -> tuple[int, int]:
        """Write a record; return its place and its length."""
        place = self._stream.tell()
        return place, self._stream.write(_record(kind, body))

    def _add(self, kind: int, body: bytes) -> None:
        """Keep a record for the summary."""
        self._summary[kind] += _record(kind, body)
        self._counts[kind] += 1


def _record(kind: int, body: bytes) -> bytes:
    return HEAD.pack(kind, len(body)) + body


def _sized(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def _text(text: str) -> bytes:
    return _sized(text.encode())


def _entries(entries: Mapping[str, str]) -> bytes:
    return _sized(b"".join(_text(key) + _text(value) for key, value in entries.items()))


def _numbers(numbers: Mapping[int, int]) -> bytes:
    return _sized(b"".join(struct.pack("<HQ", *pair) for pair in numbers.items()))
