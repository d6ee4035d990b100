"""Rows that reach the log many at a time: the same messages in the same order as rows that come one by one.

Three readers that do not know quadvis read them, each by the indexes of the file.
"""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.api import Diagram, load_text
from quadvis.errors import QuadvisError
from quadvis.output.log import LogWriter
from quadvis.output.log_reader import Log, read_log
from quadvis.output.mcap_messages import ChannelRows, message_chunks, message_size
from quadvis.output.recording import RecordedBlock, RecordedPort

TICK = 5_000_000  # ns
CDR = b"\0\1\0\0"
Message = tuple[str, int, bytes]  # topic, time (ns), data


@dataclass(frozen=True)
class Source:
    """A block with so many slots that has a row at its first and then at every so many ticks."""

    slots: int
    every: int
    first: int


SOURCES = [Source(4, 1, 0), Source(1, 7, 3), Source(9, 50, 0), Source(2, 1, 40), Source(3, 1, 10**9)]


def blocks(sources: list[Source]) -> list[RecordedBlock]:
    return [
        RecordedBlock(f"/b{index}", (RecordedPort("y", "float64", (source.slots,)),))
        for index, source in enumerate(sources)
    ]


def row(index: int, slots: int, tick: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.arange(slots) / 7 + 1000 * index + tick


def due(sources: list[Source], start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Yield tick and source in the order of a run."""
    for tick in range(start, stop):
        for index, source in enumerate(sources):
            if tick >= source.first and (tick - source.first) % source.every == 0:
                yield tick, index


def expected(sources: list[Source], ticks: int) -> list[Message]:
    """Return the messages of a run."""
    return [
        (f"/b{index}", tick * TICK, CDR + row(index, sources[index].slots, tick).tobytes())
        for tick, index in due(sources, 0, ticks)
    ]


def write_one_by_one(log: LogWriter, sources: list[Source], bounds: list[int]) -> None:
    for tick, index in due(sources, 0, bounds[-1]):
        log.write(index, tick * TICK, row(index, sources[index].slots, tick).tobytes())


def write_in_batches(log: LogWriter, sources: list[Source], bounds: list[int]) -> None:
    """Write all rows up to each bound (in ticks) block by block, as a compiled loop hands them on."""
    for start, stop in pairwise([0, *bounds]):
        rows: dict[int, list[int]] = {}
        for tick, index in due(sources, start, stop):
            rows.setdefault(index, []).append(tick)
        for index, ticks in sorted(rows.items()):
            data = np.array([row(index, sources[index].slots, tick) for tick in ticks])
            log.write_rows(index, np.array(ticks) * TICK, data.view(np.int64))


WAYS = {"rows": write_one_by_one, "batches": write_in_batches}


def by_mcap(path: Path) -> list[Message]:
    from mcap.reader import make_reader

    with path.open("rb") as file:
        return [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(file).iter_messages()
            if message.publish_time == message.log_time
        ]


def by_rosbags(path: Path) -> list[Message]:
    from rosbags.highlevel import AnyReader

    with AnyReader([path]) as reader:
        return [(connection.topic, time, bytes(raw)) for connection, time, raw in reader.messages()]


def by_mcap_ros2(path: Path) -> list[Message]:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as file:
        return [
            (channel.topic, message.log_time, CDR + np.array(decoded.y, float).tobytes())
            for _, channel, message, decoded in make_reader(
                file, decoder_factories=[DecoderFactory()]
            ).iter_decoded_messages()
        ]


def in_sequence(path: Path) -> list[Message]:
    """Return the messages as they stand in the file, without its indexes."""
    from mcap.records import Channel
    from mcap.records import Message as Found
    from mcap.stream_reader import StreamReader

    topics, found = {}, []
    with path.open("rb") as file:
        for record in StreamReader(file, validate_crcs=True).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Found):
                found.append((topics[record.channel_id], record.log_time, record.data))
    return found


READERS = [by_mcap, by_rosbags, by_mcap_ros2, in_sequence]


def by_read_log(log: Log) -> list[Message]:
    """Return the messages block by block."""
    return [
        (block.path, stamp, CDR + slots.tobytes())
        for block in log.blocks
        for stamp, slots in zip(*log.arrays(block.path), strict=True)
    ]


def block_by_block(messages: list[Message]) -> list[Message]:
    return sorted(messages, key=lambda message: message[0])


@pytest.mark.parametrize("read", READERS)
@pytest.mark.parametrize("way", WAYS)
def test_every_reader_has_all_messages_in_the_order_of_time(
    way: str, read: Callable[[Path], list[Message]], tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    with LogWriter(path, blocks(SOURCES), {}) as log:
        WAYS[way](log, SOURCES, [1, 2, 300, 301, 1000])
    assert read(path) == expected(SOURCES, 1000)
    assert by_read_log(read_log(path)) == block_by_block(expected(SOURCES, 1000))


sources = st.lists(
    st.builds(Source, st.integers(1, 5), st.integers(1, 9), st.integers(0, 30)), min_size=1, max_size=5
)
bounds = st.lists(st.integers(1, 60), min_size=1, max_size=5, unique=True).map(sorted)


@given(sources, bounds, st.sampled_from(sorted(WAYS)), st.integers(1, 2000), st.integers(1, 5000))
def test_wherever_chunks_end_the_messages_are_the_same(
    tmp_path_factory: pytest.TempPathFactory,
    sources: list[Source],
    bounds: list[int],
    way: str,
    largest: int,
    pending: int,
) -> None:
    path = tmp_path_factory.mktemp("runs") / "run.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("quadvis.output.log.LARGEST", largest)
        patch.setattr("quadvis.output.log.CHUNK", pending)
        with LogWriter(path, blocks(sources), {}) as log:
            WAYS[way](log, sources, bounds)
    for read in READERS:
        assert read(path) == expected(sources, bounds[-1])
    assert by_read_log(read_log(path)) == block_by_block(expected(sources, bounds[-1]))


@pytest.mark.parametrize("way", WAYS)
def test_the_indexes_and_the_statistics_are_those_of_the_messages(way: str, tmp_path: Path) -> None:
    from mcap.reader import make_reader
    from mcap.records import MessageIndex
    from mcap.stream_reader import StreamReader

    path = tmp_path / "run.mcap"
    with LogWriter(path, blocks(SOURCES), {"diagram": "quadvis: 1\n"}) as log:
        WAYS[way](log, SOURCES, [300, 20_000])
    messages = expected(SOURCES, 20_000)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        file.seek(0)
        indexes = [
            record
            for record in StreamReader(file, emit_chunks=True).records
            if isinstance(record, MessageIndex)
        ]
    assert summary is not None and summary.statistics is not None
    found, chunks = summary.statistics, summary.chunk_indexes
    assert (found.message_count, found.message_start_time, found.message_end_time) == (
        len(messages), messages[0][1], messages[-1][1],
    )  # fmt: skip
    counts = {summary.channels[number].topic: count for number, count in found.channel_message_counts.items()}
    topics = [topic for topic, _, _ in messages]
    assert counts == {topic: topics.count(topic) for topic in set(topics)}
    assert (found.channel_count, found.schema_count) == (len(SOURCES), len(SOURCES))
    assert (found.attachment_count, found.metadata_count) == (1, 2)
    assert found.chunk_count == len(chunks) > 1
    assert max(chunk.uncompressed_size for chunk in chunks) <= 1 << 20
    spans = [(chunk.message_start_time, chunk.message_end_time) for chunk in chunks]
    assert all(before[1] <= after[0] for before, after in pairwise(spans))
    assert sum(len(index.records) for index in indexes) == len(messages)
    assert all(index.records == sorted(index.records) for index in indexes)
    assert [index.name for index in summary.attachment_indexes] == ["diagram.yaml"]
    assert [index.name for index in summary.metadata_indexes] == ["quadvis", "summary"]
    for index in (*summary.attachment_indexes, *summary.metadata_indexes):
        kind, length = path.read_bytes()[index.offset], index.length
        assert kind in (0x09, 0x0C)
        assert int.from_bytes(path.read_bytes()[index.offset + 1 : index.offset + 9], "little") == length - 9


def test_a_run_without_rows_has_its_blocks_in_the_summary(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "empty.mcap"
    with LogWriter(path, blocks(SOURCES), {}) as log:
        log.write_rows(0, np.zeros(0, np.int64), np.zeros((0, 4), np.int64))
        log.flush()
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None and summary.statistics is not None
    assert {channel.topic for channel in summary.channels.values()} == {"/b0", "/b1", "/b2", "/b3", "/b4"}
    assert (summary.statistics.message_count, summary.statistics.chunk_count) == (0, 0)
    assert read_log(path).complete
    assert by_rosbags(path) == []


def test_a_message_that_is_larger_than_a_chunk_has_its_own() -> None:
    rows = [ChannelRows(1, np.arange(3), np.zeros((3, 100), np.int64))]
    chunks = list(message_chunks(rows, b"head", 10))
    assert [chunk.count for chunk in chunks] == [1, 1, 1]
    assert [len(chunk.data) - message_size(100) for chunk in chunks] == [4, 0, 0]
    assert [chunk.indexes[1].tolist() for chunk in chunks] == [[[0, 4]], [[1, 0]], [[2, 0]]]


def test_rows_whose_stamps_go_back_keep_their_order() -> None:
    rows = [
        ChannelRows(1, np.array([5, 2, 9]), np.zeros((3, 1), np.int64)),
        ChannelRows(2, np.array([3]), np.zeros((1, 1), np.int64)),
    ]
    (chunk,) = message_chunks(rows, b"", 1000)
    assert (chunk.first, chunk.last) == (2, 9)
    assert chunk.indexes[1][:, 0].tolist() == [5, 2, 9]
    assert chunk.indexes[1][:, 1].tolist() == sorted(chunk.indexes[1][:, 1].tolist())


@pytest.mark.parametrize("way", WAYS)
def test_every_truncation_holds_all_messages_up_to_a_time(
    way: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadvis.output.log.LARGEST", 1000)
    path, cut = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    with LogWriter(path, blocks(SOURCES), {}) as log:
        WAYS[way](log, SOURCES, [20, 60])
    data, messages = path.read_bytes(), expected(SOURCES, 60)
    counts = set()
    for size in range(0, len(data), 41):
        cut.write_bytes(data[:size])
        try:
            log_found = read_log(cut)
        except QuadvisError:
            continue
        found = by_read_log(log_found)
        assert found == block_by_block(messages[: len(found)])
        assert not log_found.complete
        counts.add(len(found))
    assert len(counts) > 30
    assert max(counts) == len(messages)


@pytest.mark.slow
def test_a_disk_that_hangs_for_a_while_costs_batches_that_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadvis.output.sink.ROOM", 50_000)
    monkeypatch.setattr("quadvis.output.log.PATIENCE", 0.0)
    path, ready, write = tmp_path / "slow.mcap", threading.Event(), os.write

    def wait(descriptor: int, data: Any) -> int:
        ready.wait()
        return write(descriptor, data)

    with LogWriter(path, blocks(SOURCES), {}) as log:
        monkeypatch.setattr("quadvis.output.sink.os.write", wait)
        write_in_batches(log, SOURCES, [*range(100, 5000, 100)])
        ready.set()
        log._sink.drain()
        log.write_rows(0, np.array([10**12]), np.zeros((1, 4), np.int64))
        log.close()
    messages = expected(SOURCES, 4900)
    found = by_mcap(path)
    assert found[-1] == ("/b0", 10**12, CDR + bytes(32))
    assert found[:-1] == [message for message in messages if message in set(found)]
    missing = [time for topic, time, data in messages if (topic, time, data) not in set(found)]
    assert 0 < len(missing) < len(messages)
    assert f"; it lacks {len(missing)} rows, the first of t = {min(missing) / 1e9:.9g} s" in log.loss
    assert read_log(path).summary["lost"] == log.loss


@pytest.mark.parametrize("way", WAYS)
def test_a_disk_that_fills_up_keeps_whole_chunks_and_the_rest_is_counted(
    way: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, room, write = tmp_path / "full.mcap", [300_000], os.write

    def fill(descriptor: int, data: Any) -> int:
        if not room[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        count = write(descriptor, data[: room[0]])
        room[0] -= count
        return count

    monkeypatch.setattr("quadvis.output.sink.os.write", fill)
    with LogWriter(path, blocks(SOURCES), {}) as log:
        WAYS[way](log, SOURCES, [*range(100, 3100, 100)])
    messages = expected(SOURCES, 3000)
    found = by_read_log(read_log(path))
    assert 0 < len(found) < len(messages)
    assert found == block_by_block(messages[: len(found)])
    first = messages[len(found)][1] / 1e9
    assert f"it lacks {len(messages) - len(found)} rows, the first of t = {first:.9g} s" in log.loss


RUN = """\
quadvis: 1
name: run
rates: {fast: 200 Hz, slow: 2 Hz, rare: 0.1 Hz}
stop_time: 60 s
log: {signals: [rare.y, ramp.y, slow.y, noise.y], every: {fast: 3}}
blocks:
  rare: {block: sources.ramp, rate: rare, with: {slope: 0.5 m/s}}
  ramp: {block: sources.ramp, rate: fast, with: {slope: 0.5 m/s}}
  slow: {block: signal.gain, rate: slow, with: {factor: 2}, in: {u: {from: ramp.y, across: sample}}}
  noise: {block: sources.noise, rate: fast, with: {sigma: 1 rad}}
  hidden: {block: sources.noise, rate: fast, with: {sigma: 1 rad}}
"""
needs_numba = pytest.mark.skipif(find_spec("numba") is None, reason="numba is not installed")


def logged(diagram: Diagram, path: Path, engine: str) -> list[list[Message]]:
    """Return the messages of a run as each reader has them."""
    diagram.run(log=path, engine=engine)
    assert read_log(path).complete
    return [read(path) for read in (by_mcap, by_rosbags, in_sequence)]


@pytest.mark.slow
@needs_numba
def test_machine_code_logs_the_messages_of_the_interpreter(tmp_path: Path) -> None:
    diagram = load_text(RUN)
    native = logged(diagram, tmp_path / "native.mcap", "native")
    python = logged(diagram, tmp_path / "python.mcap", "python")
    assert native == python
    topics = [topic for topic, _, _ in native[0]]
    assert {topic: topics.count(topic) for topic in set(topics)} == {
        "/rare": 7, "/ramp": 4001, "/slow": 121, "/noise": 4001,
    }  # fmt: skip


KILLED = f"""
import sys
from quadvis.api import load_text
text = '''{RUN.replace("stop_time: 60 s", "stop_time: 1000000 s")}'''
load_text(text.replace("fast: 3", "fast: " + sys.argv[3])).run(
    log=sys.argv[1], engine=sys.argv[2], progress=lambda time, wall: print(time, flush=True)
)
"""


@pytest.mark.parametrize(
    ("engine", "every"), [("python", 1), pytest.param("native", 200, marks=[needs_numba, pytest.mark.slow])]
)
def test_a_killed_run_keeps_all_but_its_last_moments(engine: str, every: int, tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    child = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(path), engine, str(every)],
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )
    assert child.stdout is not None
    # The first slices are short; each of the others takes a tenth of a second.
    times = [float(child.stdout.readline()) for _ in range(25)]
    child.send_signal(signal.SIGKILL)
    child.wait()
    child.stdout.close()
    log = read_log(path)
    assert not log.complete
    stamps = log.stamps("ramp.y")
    assert np.array_equal(stamps, np.arange(len(stamps)) * every * TICK)
    # The thread that writes may be a slice or two behind.
    assert stamps[-1] + every * TICK >= times[-4] * 1e9
