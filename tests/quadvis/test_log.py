"""The log: written rows are read back, here and by readers that do not know quadvis, even after `kill -9`."""

from __future__ import annotations

import errno
import math
import os
import resource
import signal
import struct
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, RunError
from quadvis.output.log import LogWriter, message_definition
from quadvis.output.log_reader import read_log
from quadvis.output.recording import RecordedBlock, RecordedPort, Recording

PLANT = RecordedBlock(
    "/plant",
    (RecordedPort("position", "float64", (3,), "m"), RecordedPort("speed", "float64", (), "m/s")),
    "physics",
)
DETECTOR = RecordedBlock(
    "/vision/detector",
    (
        RecordedPort("centres", "float64", (4, 2), "px"),
        RecordedPort("found", "bool"),
        RecordedPort("status", "int64"),
    ),
    "10 Hz",
)
METADATA = {"diagram": "quadvis: 1\nname: hover\n", "sha256": "0" * 64, "seed": "7", "name": "hover"}


def slots(*values: Any) -> bytes:
    """Lay values out as the engine does: float64, int64, or a bool in the first byte of a zeroed slot."""
    formats = {bool: "<?7x", int: "<q", float: "<d"}
    return b"".join(struct.pack(formats[type(value)], value) for value in values)


def write_flight(path: Path, rows: int = 50) -> None:
    """Log a plant at 100 Hz and a detector at 10 Hz whose values follow from the row's number."""
    with LogWriter(path, [PLANT, DETECTOR], METADATA) as log:
        for i in range(rows):
            log.write(0, i * 10_000_000, slots(float(i), -float(i), i / 7, math.sin(i)))
            if i % 10 == 0:
                log.write(1, i * 10_000_000, slots(*(float(i + j) for j in range(8)), i % 20 == 0, -i))
        log.close({"verdict": "passed"})


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    """Return the path of a finished log."""
    path = tmp_path / "flight.mcap"
    write_flight(path)
    return path


def test_signals_come_back_with_shape_type_unit_and_time(flight: Path) -> None:
    log = read_log(flight)
    i = np.arange(50)
    assert np.array_equal(log["plant.position"], np.stack([i, -i, i / 7], axis=1))
    assert np.array_equal(log["plant.speed"], [math.sin(k) for k in i])
    assert np.allclose(log.times("plant.speed"), i / 100, atol=1e-12, rtol=0)
    assert log["vision/detector.centres"].shape == (5, 4, 2)
    assert log["vision/detector.centres"][1].tolist() == [[10, 11], [12, 13], [14, 15], [16, 17]]
    assert log["vision/detector.found"].dtype == bool
    assert log["vision/detector.found"].tolist() == [True, False, True, False, True]
    assert log["vision/detector.status"].dtype == np.int64
    assert log["vision/detector.status"].tolist() == [0, -10, -20, -30, -40]
    assert log.times("vision/detector.status").tolist() == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])
    assert log.names[:2] == ("plant.position", "plant.speed")
    assert (log.units["plant.speed"], log.units["vision/detector.centres"]) == ("m/s", "px")


def test_the_facts_of_the_run_come_back(flight: Path) -> None:
    log = read_log(flight)
    assert log.diagram == METADATA["diagram"]
    assert {key: log.metadata[key] for key in ("seed", "name", "sha256")} == {
        "seed": "7",
        "name": "hover",
        "sha256": "0" * 64,
    }
    assert log.summary == {"verdict": "passed"}
    assert log.complete
    assert log.blocks == [PLANT, DETECTOR]


def test_a_batch_of_rows_is_the_same_as_its_rows_one_by_one(tmp_path: Path) -> None:
    positions = np.random.default_rng(1).normal(size=(200, 4))
    times = np.arange(200, dtype=np.int64) * 5_000_000
    with LogWriter(tmp_path / "batch.mcap", [PLANT], METADATA) as log:
        log.write_rows(0, times, positions.view(np.int64))
    with LogWriter(tmp_path / "single.mcap", [PLANT], METADATA) as log:
        for stamp, row in zip(times.tolist(), positions, strict=True):
            log.write(0, stamp, memoryview(row.tobytes()))
    batch, single = read_log(tmp_path / "batch.mcap"), read_log(tmp_path / "single.mcap")
    assert np.array_equal(batch["plant.position"], positions[:, :3])
    assert np.array_equal(batch["plant.position"], single["plant.position"])
    assert np.array_equal(batch.times("plant.speed"), single.times("plant.speed"))


def test_mcap_ros2_reads_the_same_values(flight: Path) -> None:
    reader = pytest.importorskip("mcap_ros2.reader", reason="mcap-ros2-support is not installed")
    log = read_log(flight)
    messages = list(reader.read_ros2_messages(str(flight)))
    plants = [m for m in messages if m.channel.topic == "/plant"]
    seen = [m for m in messages if m.channel.topic == "/vision/detector"]
    assert np.array_equal([m.ros_msg.position for m in plants], log["plant.position"])
    assert np.array_equal([m.ros_msg.speed for m in plants], log["plant.speed"])
    assert [m.log_time_ns / 1e9 for m in plants] == pytest.approx(log.times("plant.speed").tolist())
    assert np.array_equal([m.ros_msg.centres for m in seen], log["vision/detector.centres"].reshape(5, 8))
    assert [m.ros_msg.found for m in seen] == [1, 0, 1, 0, 1]
    assert [m.ros_msg.status for m in seen] == log["vision/detector.status"].tolist()


def read_with_rosbags(path: Path) -> dict[str, list[Any]]:
    """Return the messages of every topic as rosbags decodes them from nothing but the file."""
    highlevel = pytest.importorskip("rosbags.highlevel", reason="rosbags is not installed")
    found: dict[str, list[Any]] = {}
    with highlevel.AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(reader.deserialize(raw, connection.msgtype))
    return found


def test_rosbags_reads_the_same_values(flight: Path) -> None:
    log, found = read_log(flight), read_with_rosbags(flight)
    assert np.array_equal([m.position for m in found["/plant"]], log["plant.position"])
    assert np.array_equal([m.speed for m in found["/plant"]], log["plant.speed"])
    detected = found["/vision/detector"]
    assert np.array_equal([m.centres for m in detected], log["vision/detector.centres"].reshape(5, 8))
    assert [m.found for m in detected] == [1, 0, 1, 0, 1]


def test_a_definition_states_units_and_the_order_of_elements() -> None:
    assert message_definition(DETECTOR) == (
        "float64[8] centres  # px, 4 x 2 row by row\nint64 found  # 0 or 1\nint64 status  # 1\n"
    )


def test_names_that_ros_would_refuse_are_changed_in_the_message_only(tmp_path: Path) -> None:
    fields = tuple(RecordedPort(name) for name in ("K", "k", "2nd__Gain_", "x-y", "ä"))
    channels = [RecordedBlock("/2nd-vision/a_b", fields), RecordedBlock("/2nd/vision-a-b", fields)]
    path = tmp_path / "names.mcap"
    with LogWriter(path, channels, METADATA) as writer:
        writer.write(0, 0, slots(1.0, 2.0, 3.0, 4.0, 5.0))
        writer.write(1, 0, slots(6.0, 7.0, 8.0, 9.0, 10.0))
    found = read_with_rosbags(path)
    message = found["/2nd-vision/a_b"][0]
    assert (message.k, message.k_2, message.f_2nd_gain, message.x_y, message.f) == (1, 2, 3, 4, 5)
    log = read_log(path)
    assert [float(log[f"2nd/vision-a-b.{field.name}"][0]) for field in fields] == [6, 7, 8, 9, 10]


scalars = {
    "float64": st.floats(width=64),
    "int64": st.integers(-(2**63), 2**63 - 1),
    "bool": st.booleans(),
}
names = st.text("abcXYZ019_- é", min_size=1, max_size=6)
fields = st.builds(
    RecordedPort,
    names,
    st.sampled_from(sorted(scalars)),
    st.lists(st.integers(1, 3), max_size=3).map(tuple),
    names,
)
paths = st.lists(names, min_size=1, max_size=3).map(lambda parts: "/" + "/".join(parts))
channels = st.builds(
    RecordedBlock,
    paths,
    st.lists(fields, min_size=1, max_size=4, unique_by=lambda field: field.name).map(tuple),
    names,
    st.booleans(),
)


@st.composite
def runs(draw: st.DrawFn) -> tuple[list[RecordedBlock], list[tuple[int, int, list[Any]]]]:
    """Draw blocks and rows of them: channel, time (ns), one value for every slot."""
    blocks = draw(
        st.lists(channels, min_size=1, max_size=3, unique_by=lambda channel: channel.path.strip("/"))
    )
    rows = []
    for stamp in draw(st.lists(st.integers(0, 10**12), max_size=8)):
        index = draw(st.integers(0, len(blocks) - 1))
        values = [draw(scalars[f.type]) for f in blocks[index].ports for _ in range(f.size)]
        rows.append((index, stamp, values))
    return blocks, rows


@pytest.mark.slow
@given(runs())
@settings(max_examples=60, deadline=None)
def test_any_run_comes_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory,
    run: tuple[list[RecordedBlock], list[tuple[int, int, list[Any]]]],
) -> None:
    blocks, rows = run
    path = tmp_path_factory.mktemp("runs") / "run.mcap"
    with LogWriter(path, blocks, METADATA) as writer:
        for index, stamp, values in rows:
            writer.write(index, stamp, slots(*values))
    log = read_log(path)
    counts = {topic: len(messages) for topic, messages in read_with_rosbags(path).items()}
    for index, block in enumerate(blocks):
        signals = log.hidden if block.hidden else log
        mine = [(stamp, values) for number, stamp, values in rows if number == index]
        assert counts.get(block.path, 0) == len(mine)
        start = 0
        for field in block.ports:
            name, end = block.signal(field), start + field.size
            kind: Any = {"float64": np.float64, "int64": np.int64, "bool": bool}[field.type]
            expected: NDArray[Any] = np.array([values[start:end] for _, values in mine], kind)
            if mine or name in signals.names:
                assert signals[name].shape == (len(mine), *field.shape)
                assert signals[name].tobytes() == expected.tobytes()
                assert signals.times(name).tolist() == [stamp / 1e9 for stamp, _ in mine]
            start = end


def test_every_truncation_reads_as_a_beginning_of_the_run(flight: Path, tmp_path: Path) -> None:
    whole, data = read_log(flight), flight.read_bytes()
    cut = tmp_path / "cut.mcap"
    for size in range(0, len(data), 37):
        cut.write_bytes(data[:size])
        try:
            log = read_log(cut)
        except QuadvisError as error:
            assert size < 600, error
            continue
        assert not log.complete
        for name in log.names:
            assert np.array_equal(log[name], whole[name][: len(log[name])])


@given(st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=6))
@settings(max_examples=150, deadline=None)
def test_a_damaged_file_gives_a_log_or_a_sentence(
    tmp_path_factory: pytest.TempPathFactory, changes: list[tuple[float, int]]
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    write_flight(folder / "whole.mcap", rows=5)
    data = bytearray((folder / "whole.mcap").read_bytes())
    for place, value in changes:
        data[int(place * len(data))] = value
    (folder / "damaged.mcap").write_bytes(data)
    try:
        log = read_log(folder / "damaged.mcap")
        for name in log.names:
            assert len(log[name]) == len(log.times(name))
    except QuadvisError as error:
        assert "\n" not in str(error)


KILLED = """
import struct, sys, time
from quadvis.output.log import LogWriter
from quadvis.output.recording import RecordedBlock, RecordedPort
clock = RecordedBlock("/clock", (RecordedPort("elapsed"), RecordedPort("row", "int64")))
log = LogWriter(sys.argv[1], [clock], {"diagram": "name: killed"})
start = time.monotonic()
for row in range(1_000_000):
    elapsed = time.monotonic() - start
    log.write(0, row * 1_000_000, struct.pack("<dq", elapsed, row))
    print(elapsed, time.monotonic() - start, flush=True)  # before the row was written, and after
    time.sleep(0.001)
"""


def environment() -> dict[str, str]:
    """Return an environment in which a child finds the same modules."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def test_a_killed_run_keeps_all_but_the_last_tenth_of_a_second(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    child = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, text=True, env=environment()
    )
    assert child.stdout is not None
    lines = [child.stdout.readline() for _ in range(400)]  # one in a millisecond at most
    child.send_signal(signal.SIGKILL)
    lines += child.stdout.read().split("\n")[:-1]
    begun, done = np.array([line.split() for line in lines], float).T
    child.wait()
    child.stdout.close()
    log = read_log(path)
    assert not log.complete
    assert log.diagram == "name: killed"
    assert log["clock.row"].tolist() == list(range(len(log["clock.row"])))
    # However long the process was kept waiting between two rows.
    assert len(log["clock.row"]) >= (done < begun[-1] - 0.1).sum() > 0


def test_the_diagram_of_a_run_that_is_killed_at_once_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "early.mcap"
    code = KILLED.split("start =")[0] + "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)"
    subprocess.run([sys.executable, "-c", code, str(path)], env=environment(), check=False)
    log = read_log(path)
    assert (log.diagram, log.complete, log.names) == ("name: killed", False, ())


def test_what_stopped_a_run_is_its_summary(tmp_path: Path) -> None:
    path = tmp_path / "stopped.mcap"
    with pytest.raises(RunError), LogWriter(path, [PLANT], METADATA):
        raise RunError("the output became nan", block="plant", time=1.5)
    assert read_log(path).summary == {"stopped": "block 'plant', t = 1.5 s: the output became nan"}
    with pytest.raises(KeyboardInterrupt), LogWriter(path, [PLANT], METADATA):
        raise KeyboardInterrupt
    assert read_log(path).summary == {"stopped": "KeyboardInterrupt"}


def test_rows_wait_no_longer_than_the_next_flush(tmp_path: Path) -> None:
    log = LogWriter(tmp_path / "idle.mcap", [PLANT], METADATA)
    log.write(0, 0, slots(1.0, 2.0, 3.0, 4.0))
    log.flush()
    log._sink.drain()  # the thread that writes needs a moment
    assert read_log(tmp_path / "idle.mcap")["plant.position"].tolist() == [[1, 2, 3]]
    log.close()


def test_a_disk_that_fills_up_leaves_a_readable_log_and_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    log = LogWriter(path, [PLANT], METADATA)
    previous = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, limits[1]))
    try:
        for i in range(10_000):
            log.write(0, i, slots(float(i), 0.0, 0.0, 0.0))
            if i % 100 == 99:
                log.flush()
        log.close({"passed": "true"})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, previous)
    kept = read_log(path)
    assert not kept.complete
    count = len(kept["plant.position"])
    assert count >= 300
    assert kept["plant.position"][:, 0].tolist() == list(range(count))
    first = f"{count / 1e9:.9g}"
    assert log.loss.startswith(f"cannot write the log '{path}': ")
    assert log.loss.endswith(f"; it lacks {10_000 - count} rows, the first of t = {first} s")


def test_a_log_without_its_end_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = LogWriter(tmp_path / "end.mcap", [PLANT], METADATA)
    log.write(0, 0, slots(1.0, 2.0, 3.0, 4.0))
    log.flush()
    log._sink.drain()
    refuse(monkeypatch)
    log.close()
    assert log.loss.endswith("end.mcap': no space left on device; it lacks its end")
    assert len(read_log(tmp_path / "end.mcap")["plant.speed"]) == 1


def refuse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the disk be full from now on."""

    def write(descriptor: int, data: Any) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("quadvis.output.sink.os.write", write)


def hold(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Let the disk take nothing until the event is set."""
    ready, write = threading.Event(), os.write

    def wait(descriptor: int, data: Any) -> int:
        ready.wait()
        return write(descriptor, data)

    monkeypatch.setattr("quadvis.output.sink.os.write", wait)
    return ready


def test_a_disk_that_hangs_for_a_while_costs_rows_but_stops_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadvis.output.sink.ROOM", 50_000)
    monkeypatch.setattr("quadvis.output.log.PATIENCE", 0.1)
    log = LogWriter(tmp_path / "slow.mcap", [PLANT], METADATA)
    ready = hold(monkeypatch)
    for i in range(10_000):  # 10,000 rows of 36 bytes and more
        log.write(0, i, slots(float(i), 0.0, 0.0, 0.0))
    ready.set()
    log._sink.drain()
    for i in range(10_000, 10_100):
        log.write(0, i, slots(float(i), 0.0, 0.0, 0.0))
    log.close({"passed": "true"})
    kept = read_log(tmp_path / "slow.mcap")
    rows = kept["plant.position"][:, 0].tolist()
    gap = next(i for i, row in enumerate(rows) if row != i)
    assert kept.complete
    assert rows == [*range(gap), *range(10_000, 10_100)]
    assert 500 < gap < 5_000
    sentence = f"; it lacks {10_000 - gap} rows, the first of t = {gap / 1e9:.9g} s"
    assert log.loss == f"the disk is too slow for the log '{tmp_path / 'slow.mcap'}'{sentence}"
    assert kept.summary == {"passed": "true", "lost": log.loss}


def test_a_disk_that_is_slow_for_a_moment_costs_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadvis.output.sink.ROOM", 50_000)
    monkeypatch.setattr("quadvis.output.log.PATIENCE", 60.0)
    log = LogWriter(tmp_path / "slow.mcap", [PLANT], METADATA)
    ready = hold(monkeypatch)
    threading.Timer(0.1, ready.set).start()
    for i in range(10_000):
        log.write(0, i, slots(float(i), 0.0, 0.0, 0.0))
    log.close()
    assert log.loss == ""
    assert len(read_log(tmp_path / "slow.mcap")["plant.speed"]) == 10_000


def test_batches_that_the_disk_itself_takes_are_waited_for_one_by_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A batch that is written and not yet on the disk is no sign of a disk that hangs."""
    synced: list[int] = []

    def sync(descriptor: int) -> None:
        time.sleep(0.005)
        synced.append(descriptor)

    monkeypatch.setattr("quadvis.output.sink.os.fsync", sync)
    log = LogWriter(tmp_path / "synced.mcap", [PLANT], METADATA, synced=True)
    for i in range(10):
        log.write(0, i, slots(float(i), 0.0, 0.0, 0.0))
        log.flush()
    log.close()
    assert (log.loss, log.lost) == ("", 0)
    assert len(read_log(tmp_path / "synced.mcap")["plant.speed"]) == 10
    assert len(synced) >= 10


def test_a_disk_that_hangs_for_good_is_given_up_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadvis.output.sink.HUNG", 0.1)
    log = LogWriter(tmp_path / "hung.mcap", [PLANT], METADATA)
    ready = hold(monkeypatch)
    for i in range(100):
        log.write(0, i, slots(float(i), 0.0, 0.0, 0.0))
    log.close()
    assert "the disk takes nothing any more; it lacks 100 rows, the first of t = 0 s" in log.loss
    ready.set()


def test_what_the_disk_refused_is_a_note_on_what_stopped_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (
        pytest.raises(RunError, match="the output became nan") as found,
        LogWriter(tmp_path / "run.mcap", [PLANT], METADATA) as log,
    ):
        refuse(monkeypatch)
        log.write(0, 0, slots(1.0, 2.0, 3.0, 4.0))
        raise RunError("the output became nan")
    assert found.value.__notes__ == [log.loss]


def test_the_indexes_of_chunks_lead_to_every_row(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "chunks.mcap"
    with LogWriter(path, [PLANT, DETECTOR], METADATA) as log:
        for i in range(50):
            log.write(0, i, slots(float(i), 0.0, 0.0, 0.0))
            log.flush()
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count == 50
        assert [message.log_time for _, _, message in reader.iter_messages()] == [*range(50)]


def test_a_path_that_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, why in [
        (tmp_path / "none" / "run.mcap", "there is no folder '.*none'$"),
        (tmp_path, "it is a folder$"),
        (tmp_path / "pipe", "it is a device or a pipe, not a file$"),
    ]:
        with pytest.raises(QuadvisError, match=rf"cannot write the log '.*': {why}"):
            LogWriter(path, [PLANT], METADATA)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is empty; its run ended before anything was written"),
        (b"time,x\n0,1\n" * 40, "is not a log; give a file written by 'quadvis run'"),
        (b"abc", "was not written by quadvis"),
        (b"\x89MCAP0\r\n", "was not written by quadvis"),
    ],
)
def test_what_is_no_log_is_a_sentence(tmp_path: Path, content: bytes, sentence: str) -> None:
    path = tmp_path / "other"
    path.write_bytes(content)
    with pytest.raises(QuadvisError, match=sentence):
        read_log(path)


def test_an_mcap_file_of_another_tool_is_a_sentence(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start()
        schema = writer.register_schema("Thing", "jsonschema", b"{}")
        writer.add_message(writer.register_channel("/thing", "json", schema), 0, b"{}", 0)
        writer.finish()
    with pytest.raises(
        QuadvisError, match="was not written by quadvis; give a file written by 'quadvis run'"
    ):
        read_log(path)


def test_a_log_that_was_compressed_by_another_tool_still_reads(flight: Path, tmp_path: Path) -> None:
    from mcap import records
    from mcap.stream_reader import StreamReader
    from mcap.writer import CompressionType, Writer

    packed = tmp_path / "packed.mcap"
    with flight.open("rb") as source, packed.open("wb") as sink:
        writer: Any = Writer(sink, compression=CompressionType.ZSTD)
        writer.start("ros2")
        for record in StreamReader(source).records:
            if isinstance(record, records.Metadata):
                writer.add_metadata(record.name, record.metadata)
            elif isinstance(record, records.Schema):
                writer.register_schema(record.name, record.encoding, record.data)
            elif isinstance(record, records.Channel):
                writer.register_channel(
                    record.topic, record.message_encoding, record.schema_id, record.metadata
                )
            elif isinstance(record, records.Message):
                writer.add_message(record.channel_id, record.log_time, record.data, record.publish_time)
            elif isinstance(record, records.DataEnd):
                break
        writer.finish()
    assert np.array_equal(read_log(packed)["plant.position"], read_log(flight)["plant.position"])


def test_a_missing_log_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(
        QuadvisError, match=r"cannot read the log '.*gone.mcap': there is no such file or folder$"
    ):
        read_log(tmp_path / "gone.mcap")


def test_an_unknown_signal_is_answered_with_a_near_one(flight: Path) -> None:
    with pytest.raises(QuadvisError, match=r"no signal 'plant.positon'; did you mean 'plant.position'\?"):
        read_log(flight)["plant.positon"]


def test_a_recording_grows_while_it_is_read() -> None:
    recording = Recording([PLANT, DETECTOR])
    assert recording["plant.position"].shape == (0, 3)
    for i in range(3):
        recording.append(0, i * 500_000_000, slots(float(i), 0.0, 0.0, -1.0))
        assert recording["plant.position"][:, 0].tolist() == list(range(i + 1))
    assert recording.times("plant.speed").tolist() == [0, 0.5, 1]
    assert recording["vision/detector.centres"].shape == (0, 4, 2)
    assert recording.units == read_units(PLANT, DETECTOR)


def read_units(*blocks: RecordedBlock) -> dict[str, str]:
    """Return the units as the channels declare them."""
    return {f"{block.path[1:]}.{field.name}": field.unit for block in blocks for field in block.ports}


def test_rows_of_a_wrong_size_are_refused(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "log.mcap", [PLANT], METADATA) as log:
        with pytest.raises(ValueError, match="has 32 bytes, not 24"):
            log.write(0, 0, b"\0" * 24)
        with pytest.raises(ValueError, match="has 32 bytes, not 24"):
            log.write_rows(0, np.arange(2), np.zeros((2, 3), np.int64))
        with pytest.raises(ValueError, match="3 times for 2 rows"):
            log.write_rows(0, np.arange(3), np.zeros((2, 4), np.int64))
    with pytest.raises(ValueError, match="'/scope' has no outputs to log"):
        LogWriter(tmp_path / "log.mcap", [RecordedBlock("/scope", ())], METADATA)


def test_importing_the_log_imports_no_packing() -> None:
    code = textwrap.dedent("""
        import sys, quadvis.output.log, quadvis.output.log_reader
        print(*[name for name in ("lz4", "zstandard") if name in sys.modules])
    """)
    result = subprocess.run(
        [sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == ""
