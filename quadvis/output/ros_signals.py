"""Signals from the messages of ROS 2 in an MCAP file: "topic.field", as in "imu.angular_velocity.x".

Each number of a message is a signal, and so is an array of numbers, or a message of nothing but numbers of
one kind, such as a vector or a quaternion (x, y, z, w). Times are those at which the messages were logged,
counted from the first message of the file. Texts, pictures, lists of messages, and lists of changing length
are none.

The messages are read by the definitions in the file, by ourselves: so a cut or damaged file is played as far
as it goes, its bytes are trusted no more than those of a log, and the numbers of equal messages are columns
of one array. Readers of others make an object of each message.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted
from quadvis.graph.graph import Index
from quadvis.machine.inputs import read_input
from quadvis.output import mcap_records as mcap
from quadvis.output.foreign_recording import KINDS, ForeignSignals
from quadvis.output.recording import RecordedPort
from quadvis.output.ros_layout import MessageError, MessageLayout, MessageNumbers, layout
from quadvis.output.ros_schema import read_schema, short_name

MOST_BYTES = 1 << 31
LATEST = (1 << 63) - 1  # ns
KEPT = 16  # layouts of messages of one size that are compared before another walk
_ANY = mcap.SchemaRecord(0, "", "", "")


class RosSignals(ForeignSignals):
    """The numbers in the messages of ROS 2."""

    def find(self, name: str) -> tuple[int, int, RecordedPort, Index]:
        """Return the place of a signal; its topic may begin with a slash."""
        plain = name.removeprefix("/")
        topic = plain.partition(".")[0]
        if topic in self.unplayed:
            raise QuadvisError(f"there is no signal {quoted(name)}: {self.unplayed[topic]}")
        return super().find(plain)


class _Contents(NamedTuple):
    """What stands in a file: definitions and channels by number, times (ns) and bytes of each channel."""

    schemas: dict[int, mcap.SchemaRecord]
    channels: dict[int, mcap.ChannelRecord]
    messages: dict[int, list[tuple[int, bytes]]]


def read_messages(path: str | Path) -> RosSignals:
    """Read the signals of an MCAP file of ROS 2; QuadvisError if it holds no message with numbers."""
    data = read_input(path, MOST_BYTES, "the recording")
    signals = RosSignals(Path(path))
    scan = mcap.RecordScan(data)
    contents = _read(scan)
    begin = min((time for each in contents.messages.values() for time, _ in each), default=0)
    lost = sum(_topic(signals, number, contents, begin) for number in _first_of_topics(contents))
    if not signals.names:
        why = next(iter(signals.unplayed.values()), "it holds no messages")
        raise QuadvisError(f"'{path}' has no numbers of ROS 2 to play: {why}")
    found = [f"{lost} messages contradict their definition"] if lost else []
    if scan.damaged or not scan.ended:
        found.append("it is cut short or damaged")
    if found:
        signals.damage = f"'{path}' is played as far as it goes: {' and '.join(found)}"
    return signals


def _read(scan: mcap.RecordScan) -> _Contents:
    contents = _Contents({}, {}, {})
    for record in scan.records():
        if isinstance(record, mcap.MessageRecord):
            contents.messages.setdefault(record.channel, []).append((record.time, record.data))
        elif isinstance(record, mcap.ChannelRecord):
            contents.channels.setdefault(record.number, record)
        elif isinstance(record, mcap.SchemaRecord):
            contents.schemas.setdefault(record.number, record)
    return contents


def _first_of_topics(contents: _Contents) -> list[int]:
    """Return one channel of each topic; the messages of several with one type come together in it."""
    first: dict[str, int] = {}
    for number, channel in contents.channels.items():
        one = first.setdefault(channel.topic, number)
        if one != number and _kind(channel) == _kind(contents.channels[one]):
            contents.messages.setdefault(one, []).extend(contents.messages.pop(number, []))
    return list(first.values())


def _kind(channel: mcap.ChannelRecord) -> tuple[int, str]:
    return channel.schema, channel.encoding


def _topic(signals: RosSignals, number: int, contents: _Contents, begin: int) -> int:
    """Take the signals of a topic; return how many messages contradict their definition."""
    channel = contents.channels[number]
    topic = channel.topic.strip("/")
    schema = contents.schemas.get(channel.schema, _ANY)
    messages = sorted(contents.messages.get(number, []), key=lambda each: each[0])
    try:
        if channel.encoding != "cdr" or schema.language not in ("ros2msg", ""):
            kind = channel.encoding if channel.encoding != "cdr" else schema.language
            raise QuadvisError(f"its messages are {quoted(kind)}; CDR with definitions of ROS 2 is read")
        types = read_schema(schema.name, schema.definition)
    except QuadvisError as error:
        signals.unplayed[topic] = f"topic {quoted(topic)} is not read, {error}"
        return 0
    groups: dict[MessageLayout, list[int]] = {}
    by_size: dict[int, list[MessageLayout]] = {}
    lost = 0
    for row, (_, data) in enumerate(messages):
        known = by_size.setdefault(len(data), [])
        made = next((each for each in known if each.fits(data)), None)
        if made is None:
            try:
                made = layout(types, short_name(schema.name), data)
            except MessageError:
                lost += 1
                continue
            known.insert(0, made)
            del known[KEPT:]
        groups.setdefault(made, []).append(row)
    stamps = np.array([min(time - begin, LATEST) for time, _ in messages], np.int64)
    _take(signals, topic, stamps, [data for _, data in messages], groups)
    return lost


def _take(
    signals: RosSignals,
    topic: str,
    stamps: NDArray[np.int64],
    messages: Sequence[bytes],
    groups: dict[MessageLayout, list[int]],
) -> None:
    """Take the numbers of all messages of a topic, column by column."""
    if not groups:
        signals.unplayed[topic] = f"topic {quoted(topic)} has no messages that can be read"
    rows = np.array(sorted(row for each in groups.values() for row in each), int)
    columns: dict[str, list[tuple[NDArray[np.int64], MessageNumbers, NDArray[Any]]]] = {}
    for made, members in groups.items():
        size = len(messages[members[0]])
        table = np.frombuffer(b"".join(messages[row] for row in members), np.uint8).reshape(-1, size)
        for numbers in made.numbers:
            places = np.searchsorted(rows, members)
            columns.setdefault(numbers.name, []).append((places, numbers, _column(table, numbers)))
    for name, parts in columns.items():
        full = f"{topic}.{name}" if name else topic
        lengths = {numbers.shape for _, numbers, _ in parts}
        if len(lengths) > 1 or any(0 in shape for shape in lengths):
            sizes = sorted(shape[0] for shape in lengths)
            signals.unplayed[full] = f"it has {sizes[0]} to {sizes[-1]} elements, and not always as many"
            continue
        values = np.empty((len(rows), *parts[0][1].shape), parts[0][2].dtype)
        for places, _, column in parts:
            values[places] = column
        signals.take(full, parts[0][1].unit, stamps[rows], values)


def _column(table: NDArray[np.uint8], numbers: MessageNumbers) -> NDArray[Any]:
    """Return the numbers of N messages (N, bytes) as float64, int64 or bool, (N, *shape)."""
    kind = np.dtype(numbers.type)
    count = int(np.prod(numbers.shape, dtype=int))
    inside = np.ascontiguousarray(table[:, numbers.start : numbers.start + count * kind.itemsize])
    native = {"float64": "<f8", "int64": "<i8", "bool": "?"}[KINDS[kind.kind]]
    flat: NDArray[Any] = (inside if kind.kind == "b" else inside.view(kind)).astype(native)
    return flat.reshape((len(table), *numbers.shape))
