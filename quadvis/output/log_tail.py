"""The end of a log whose writer has died: somebody else adds the rows that it had no time to write."""

from __future__ import annotations

import fcntl
import io
import mmap
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from quadvis.output import mcap_records as mcap
from quadvis.output.log import LARGEST
from quadvis.output.mcap_messages import ChannelRows, Stamps, message_chunks
from quadvis.output.mcap_writer import McapWriter
from quadvis.output.recording import Slots

_TIMES = struct.Struct("<Q8x")  # an entry of an index: the stamp, and a place


def add_tail(path: str | Path, rows: Mapping[str, tuple[Stamps, Slots]]) -> int:
    """Add rows by their topics, each with its stamp (ns), to a log that has no end; return how many.

    Only what is later than the last row of its topic is added. What is cut off at the end of the file is
    given up before. Several may do this at the same time, each with topics of its own. ValueError if the file
    is no log without an end, OSError if the system refuses.
    """
    with open(path, "r+b") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            found = _Survey.of(data)
        new = []
        for topic, (stamps, slots) in rows.items():
            channel = found.channels.get(topic)
            if channel is not None:
                later = stamps > found.last.get(channel, -1)
                new.append(ChannelRows(channel, stamps[later], slots[later]))
        new = [each for each in new if len(each.stamps)]
        file.truncate(found.end)
        file.seek(found.end)
        file.write(_chunks(new))
        return sum(len(each.stamps) for each in new)


class _Survey(NamedTuple):
    """Where the last whole record of a log ends, its channels by topic, and their last stamps (ns)."""

    end: int
    channels: dict[str, int]
    last: dict[int, int]

    @staticmethod
    def of(data: mmap.mmap) -> _Survey:
        if data[: len(mcap.MAGIC)] != mcap.MAGIC:
            raise ValueError("it does not begin as a log")
        position, chunks, indexes = len(mcap.MAGIC), [], {}
        while position + mcap.HEAD.size <= len(data):
            kind, length = mcap.HEAD.unpack_from(data, position)
            body, end = position + mcap.HEAD.size, position + mcap.HEAD.size + length
            if kind in (mcap.DATA_END, mcap.FOOTER):
                raise ValueError("it has its end")
            if end > len(data):
                break
            if kind == mcap.CHUNK:
                chunks.append((position, end))
            elif kind == mcap.MESSAGE_INDEX:
                indexes[int.from_bytes(data[body : body + 2], "little")] = body + 6, end
            position = end
        last = {
            channel: max((stamp for (stamp,) in _TIMES.iter_unpack(data[begin:until])), default=-1)
            for channel, (begin, until) in indexes.items()
        }
        channels = {}
        # The first chunk describes the channels; the indexes of the last one may be cut off.
        for start, until in {*chunks[:1], *chunks[-1:]}:
            for record in mcap.RecordScan(mcap.MAGIC + data[start:until]).records():
                if isinstance(record, mcap.ChannelRecord):
                    channels[record.topic] = record.number
                elif isinstance(record, mcap.MessageRecord):
                    last[record.channel] = max(record.time, last.get(record.channel, -1))
        return _Survey(position, channels, last)


def _chunks(rows: list[ChannelRows]) -> bytes:
    """Return rows as chunks with their indexes, as they stand in the middle of a file."""
    if not rows:
        return b""
    buffer = io.BytesIO()
    writer = McapWriter(buffer, "", "")
    start = buffer.tell()
    for chunk in message_chunks(rows, b"", LARGEST):
        writer.add_chunk(chunk)
    return buffer.getvalue()[start:]
