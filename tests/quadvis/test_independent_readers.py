"""A hover as programs of others read it: values and times of every signal against the run itself, to the bit.

None of the readers shares code with ours; each gets the file alone. Four read the log, five its exports.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from quadvis.api import load
from quadvis.cli import main
from quadvis.run.result import Result

HOVER = Path(__file__).resolve().parents[2] / "diagrams" / "hover.yaml"
NAMES = (
    "craft.position",
    "imu.gyro",
    "eyes/camera.centres",
    "control/roll.level",
    "control/mixer.saturated",
)


class Read(NamedTuple):
    """A signal as a reader gives it: times (N,) in ns, and its numbers (N, size)."""

    stamps: NDArray[np.int64]
    numbers: NDArray[np.float64]


class Flown(NamedTuple):
    """A run that was kept in memory, and the log of the same run."""

    result: Result
    log: Path


pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    log = tmp_path_factory.mktemp("hover") / "hover.mcap"
    diagram = load(HOVER, variant="geometric", stop_time="2 s")
    diagram.run(log=log)
    return Flown(diagram.run(), log)


def gathered(
    rows: Mapping[str, list[tuple[int, Any]]], fields: Callable[[Any], Mapping[str, Any]]
) -> dict[str, Read]:
    """Return the signals of messages, by topic a list of stamps and messages."""
    found = {}
    for topic, messages in rows.items():
        stamps = np.array([stamp for stamp, _ in messages], np.int64)
        columns = [fields(message) for _, message in messages]
        for name in columns[0]:
            numbers = np.array([np.ravel(each[name]) for each in columns], np.float64)
            found[f"{topic.strip('/')}.{name}"] = Read(stamps, numbers)
    return found


def by_mcap_ros2(log: Path) -> dict[str, Read]:
    """mcap and mcap-ros2-support, by Foxglove: the reference."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    rows: dict[str, list[tuple[int, Any]]] = {}
    with log.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            assert message.publish_time == message.log_time
            rows.setdefault(channel.topic, []).append((message.log_time, decoded))
    return gathered(rows, lambda message: {name: getattr(message, name) for name in message.__slots__})


def by_rosbags(log: Path) -> dict[str, Read]:
    """rosbags, by Ternaris: its own reader of MCAP, and its own CDR."""
    from rosbags.highlevel import AnyReader

    rows: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([log]) as reader:
        for connection, stamp, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            rows.setdefault(connection.topic, []).append((stamp, message))
    return gathered(
        rows, lambda message: {name: value for name, value in vars(message).items() if name[0] != "_"}
    )


def by_pybag(log: Path) -> dict[str, Read]:
    """pybag: another reader of MCAP and CDR, without any of these libraries."""
    from pybag.mcap_reader import McapFileReader

    rows: dict[str, list[tuple[int, Any]]] = {}
    with McapFileReader.from_file(log) as reader:
        for topic in reader.get_topics():
            rows[topic] = [(each.log_time, each.data) for each in reader.messages(topic)]
    return gathered(
        rows, lambda message: {name: value for name, value in vars(message).items() if name[0] != "_"}
    )


def by_numpy(log: Path) -> dict[str, Read]:
    """mcap in the order of the file, and numpy in place of any CDR: a message is a row of 8-byte numbers."""
    import json

    from mcap.records import Channel, Message
    from mcap.stream_reader import StreamReader

    channels: dict[int, Channel] = {}
    rows: dict[int, list[tuple[int, bytes]]] = {}
    with log.open("rb") as file:
        for record in StreamReader(file).records:
            if isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                rows.setdefault(record.channel_id, []).append((record.log_time, record.data[4:]))
    found = {}
    for number, messages in rows.items():
        data = np.array([np.frombuffer(row, "<i8") for _, row in messages])
        stamps, first = np.array([stamp for stamp, _ in messages]), 0
        for name, kind, shape, _ in json.loads(channels[number].metadata["fields"]):
            part = data[:, first : first + int(np.prod(shape))]
            first += int(np.prod(shape))
            numbers = part.view("<f8") if kind == "float64" else part.astype(float)
            found[f"{channels[number].topic.strip('/')}.{name}"] = Read(stamps, numbers)
    return found


@pytest.mark.parametrize(
    "read", [by_mcap_ros2, by_rosbags, by_pybag, by_numpy], ids=lambda each: each.__name__
)
def test_a_log_has_every_signal_of_the_run(read: Callable[[Path], dict[str, Read]], flown: Flown) -> None:
    found = read(flown.log)
    names = [name for name in flown.result if name in found]
    assert len(names) > 40 and set(NAMES) <= set(names)
    assert {name for name in found if not name.startswith("_")} == set(names)
    for name in names:
        check(found[name], flown.result, name)


def check(found: Read, result: Result, name: str) -> None:
    np.testing.assert_array_equal(found.stamps, nanoseconds(result.times(name)), err_msg=name)
    values = result[name]
    np.testing.assert_array_equal(found.numbers, values.reshape(len(values), -1), err_msg=name)


def exported(flown: Flown, folder: Path, suffix: str, *names: str) -> Path:
    path = folder / f"out{suffix}"
    chosen = [word for name in names for word in ("--signals", name)]
    assert main(["export", str(flown.log), "-o", str(path), *chosen]) == 0
    return path


def nanoseconds(times: Any) -> NDArray[np.int64]:
    return np.rint(np.asarray(times, np.float64) * 1e9).astype(np.int64)


@pytest.mark.parametrize("name", NAMES)
def test_pandas_reads_csv(flown: Flown, name: str, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    exact = {"float_precision": "round_trip"} if pandas.__version__ < "3" else {}  # from 3 on it always is
    frame = pandas.read_csv(exported(flown, tmp_path, ".csv", name), **exact)
    times, *columns = (frame[column].to_numpy(float) for column in frame.columns)
    check(Read(nanoseconds(times), np.column_stack(columns)), flown.result, name)


@pytest.mark.parametrize("name", NAMES)
def test_pyarrow_reads_parquet(flown: Flown, name: str, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(exported(flown, tmp_path, ".parquet", name))
    times, *columns = (column.to_numpy().astype(float) for column in table.columns)
    check(Read(nanoseconds(times), np.column_stack(columns)), flown.result, name)


def test_scipy_reads_the_file_of_matlab(flown: Flown, tmp_path: Path) -> None:
    from scipy.io import loadmat

    read = loadmat(exported(flown, tmp_path, ".mat", *NAMES), simplify_cells=True)
    found = {each["name"]: each for each in read.values() if isinstance(each, dict)}
    assert found.keys() == set(NAMES)
    for name, each in found.items():
        numbers = np.asarray(each["values"], float).reshape(len(each["time"]), -1)
        check(Read(nanoseconds(each["time"]), numbers), flown.result, name)


def test_pyulog_reads_the_ulog(flown: Flown, tmp_path: Path) -> None:
    pyulog = pytest.importorskip("pyulog")
    log = pyulog.ULog(str(exported(flown, tmp_path, ".ulg", *NAMES)))
    assert not log.file_corruption and len(log.data_list) == len({name.partition(".")[0] for name in NAMES})
    found = {data.name: data.data for data in log.data_list}
    for name in NAMES:
        path, _, port = name.rpartition(".")
        (topic,) = [each for each in found if each.replace("_", "/") == path.replace("_", "/")]
        columns = [values for field, values in found[topic].items() if field.partition("[")[0] == port]
        stamps = found[topic]["timestamp"].astype(np.int64) * 1000
        check(Read(stamps, np.column_stack(columns).astype(float)), flown.result, name)


def test_numpy_reads_npz(flown: Flown, tmp_path: Path) -> None:
    with np.load(exported(flown, tmp_path, ".npz", *NAMES)) as arrays:
        for name in NAMES:
            numbers = arrays[name].reshape(len(arrays[name]), -1).astype(float)
            check(Read(nanoseconds(arrays[f"{name}.time"]), numbers), flown.result, name)
