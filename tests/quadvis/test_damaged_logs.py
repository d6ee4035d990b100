"""Logs that were cut, damaged or made to harm: the intact part is read, and a sentence reports the rest."""

from __future__ import annotations

import hashlib
import json
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.output.log import LogWriter
from quadvis.output.log_reader import Log, log_facts, read_log
from quadvis.output.recording import RecordedBlock, RecordedPort
from tests.stages import mostly_slow

DIAGRAM = "quadvis: 1\nname: x\nfigures:\n- {title: one, signals: [c.y]}\n"
FACTS = {"diagram": DIAGRAM, "name": "x", "hash": hashlib.sha256(DIAGRAM.encode()).hexdigest()}
ROWS, ROW = 60, struct.Struct("<dq")
CLOCK = RecordedBlock("/c", (RecordedPort("y", unit="m"), RecordedPort("row", "int64")), "fast")


def write(path: Path, rows: int = ROWS, every: int = 10) -> bytes:
    """Write a log of rows 0.1 s apart, in chunks of so many, and return what is in the file."""
    with LogWriter(path, [CLOCK], FACTS) as log:
        for row in range(rows):
            log.write(0, row * 100_000_000, ROW.pack(row / 7, row))
            if row % every == every - 1:
                log.flush()
    return path.read_bytes()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return write(tmp_path_factory.mktemp("whole") / "log.mcap")


def read(path: Path, data: bytes) -> Log:
    path.write_bytes(data)
    return read_log(path)


def chunks(data: bytes) -> list[tuple[int, int]]:
    """Return where the chunks of rows begin and end, the first one without rows left out."""
    found, place = [], 8
    while place < len(data) - 8:
        kind, length = struct.unpack_from("<BQ", data, place)
        if kind == 6:
            found.append((place, place + 9 + length))
        place += 9 + length
    return found


def rows(log: Log) -> list[int]:
    found: list[int] = log["c.row"].tolist() if "c.row" in log.names else []
    assert np.array_equal(log["c.y"], np.array(found) / 7) if found else True
    return found


def test_a_whole_log_has_no_damage_and_an_end(tmp_path: Path, whole: bytes) -> None:
    log = read(tmp_path / "log", whole)
    assert (log.damage, log.complete, log.end) == ("", True, 5.9)
    assert rows(log) == list(range(ROWS))


def test_bytes_behind_the_end_are_ignored(tmp_path: Path, whole: bytes) -> None:
    assert read(tmp_path / "log", whole + bytes(5000)).complete


def test_a_cut_chunk_gives_the_rows_that_are_there(tmp_path: Path, whole: bytes) -> None:
    start, end = chunks(whole)[2]
    log = read(tmp_path / "log", whole[: (start + end) // 2])
    assert rows(log) == list(range(len(rows(log))))
    assert 20 < len(rows(log)) < 30
    assert log.end == pytest.approx((len(rows(log)) - 1) / 10)
    assert log.damage == f"the log '{log.path}' is cut short; what is left of it goes to {log.end:g} s"
    assert not log.complete


@pytest.mark.parametrize("chunk", range(1, 6))
@pytest.mark.parametrize("part", [0.0, 0.01, 0.03, 0.3, 0.6, 0.99])
def test_behind_a_damaged_chunk_the_next_one_is_read(
    chunk: int, part: float, tmp_path: Path, whole: bytes
) -> None:
    start, end = chunks(whole)[chunk]
    data = bytearray(whole)
    place = start + int(part * (end - start))
    data[place] ^= 0x55
    log = read(tmp_path / "log", bytes(data))
    lost = set(range(ROWS)) - set(rows(log))
    assert lost <= set(range(10 * chunk, 10 * chunk + 10))
    assert log.complete == (not lost) or "damaged" in log.damage
    assert "cut short" not in log.damage


def test_a_hole_of_zeros_loses_only_what_was_there(tmp_path: Path, whole: bytes) -> None:
    (start, _), (_, end) = chunks(whole)[2], chunks(whole)[3]
    log = read(tmp_path / "log", whole[:start] + bytes(end - start) + whole[end:])
    assert rows(log) == [*range(20), *range(40, ROWS)]
    assert log.damage == f"the log '{log.path}' is damaged in 1 place; what is left of it goes to 5.9 s"


def test_a_piece_that_is_missing_or_put_in_is_passed_over(tmp_path: Path, whole: bytes) -> None:
    start, end = chunks(whole)[2]
    for data in (whole[: start + 100] + whole[end - 7 :], whole[:start] + b"\x06words" * 9 + whole[start:]):
        log = read(tmp_path / "log", data)
        assert set(range(ROWS)) - set(rows(log)) <= set(range(20, 30))
        assert "is damaged in 1 place" in log.damage


def test_blocks_whose_description_is_lost_are_known_from_the_index(tmp_path: Path, whole: bytes) -> None:
    data = bytearray(whole)
    data[chunks(whole)[0][0] + 60] ^= 1
    log = read(tmp_path / "log", bytes(data))
    assert set(rows(log)) >= set(range(10, ROWS))
    assert "damaged in 1 place" in log.damage


def test_a_damaged_index_costs_no_row(tmp_path: Path, whole: bytes) -> None:
    data = bytearray(whole)
    data[-60] ^= 0xFF
    log = read(tmp_path / "log", bytes(data))
    assert rows(log) == list(range(ROWS))
    assert not log.complete
    assert "index" in log.damage


@pytest.mark.parametrize(("old", "new"), [(b"name: x", b"name: y"), (b"c.y", b"c.z"), (b"one", b"two")])
def test_a_diagram_that_is_not_the_one_that_ran_is_told(
    old: bytes, new: bytes, tmp_path: Path, whole: bytes
) -> None:
    start, place = whole.index(b"diagram.yaml") - 20, whole.index(DIAGRAM.encode())
    end = place + len(DIAGRAM)
    assert zlib.crc32(whole[start:end]).to_bytes(4, "little") == whole[end : end + 4]
    body = whole[start:place] + DIAGRAM.encode().replace(old, new)
    data = whole[:start] + body + zlib.crc32(body).to_bytes(4, "little") + whole[end + 4 :]
    log = read(tmp_path / "log", data)
    assert log.damage == f"the log '{log.path}' holds another diagram than the one that ran: its hash differs"
    assert rows(log) == list(range(ROWS))


# sizes and shapes


def packed(path: Path, fields: Any, size: int = 8, count: int = 3, packing: str = "NONE") -> Path:
    """Write a log as another tool may, whose rows have so many bytes."""
    from mcap.writer import CompressionType, Writer

    with path.open("wb") as file:
        writer: Any = Writer(file, chunk_size=1 << 30, compression=CompressionType[packing])
        writer.start("ros2")
        writer.add_attachment(0, 0, "diagram.yaml", "application/yaml", DIAGRAM.encode())
        writer.add_metadata("quadvis", {"format": "1", "name": "x"})
        schema = writer.register_schema("C", "ros2msg", b"float64 y")
        described = {"fields": fields if isinstance(fields, str) else json.dumps(fields), "rate": "a"}
        channel = writer.register_channel("/c", "cdr", schema, described)
        for row in range(count):
            writer.add_message(channel, row * 10**8, b"\0\1\0\0" + bytes(size), row * 10**8)
        writer.finish()
    return path


@pytest.mark.parametrize(
    "fields",
    [
        [["y", "float64", [0], "1"]],
        [["y", "float64", [1.5], "1"]],
        [["y", "float64", [-1], "1"]],
        [["y", "float64", [-2, -4], "1"]],
        [["y", "float64", [True], "1"]],
        [["y", "float64", ["1"], "1"]],
        [["y", "float64", [1 << 23, 1 << 23, 1 << 23], "1"]],
        [["y", "float64", [1 << 70], "1"]],
        [["y", "float64", [1] * 100_000 + [2], "1"]],
        [["y", "float64", 3, "1"]],
        [["y", "float64", "33", "1"]],
        [["y", "float64", {"1": 2}, "1"]],
        [["y", "float65", [], "1"]],
        [["y", [], [], "1"]],
        [["y", "float64", []]],
        [["\ud800", "float64", [], "1"]],
        [["y", "float64", [], "\udfff"]],
        [],
        [[]],
        {},
        7,
        None,
        "[" * 100_000,
        '[["y", "float64", [1e999], "1"]]',
        '[["y", "float64", [NaN], "1"]]',
        '[["y", "float64", [' + "9" * 5000 + '], "1"]]',
        "",
    ],
    ids=lambda fields: str(fields)[:40],
)
def test_a_description_that_no_block_has_is_one_sentence(
    fields: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = packed(tmp_path / "log.mcap", fields)
    assert main(["plot", str(path)]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "'/c'" in told
    assert len(told) < 300


@pytest.mark.parametrize("packing", ["NONE", "LZ4", "ZSTD"])
def test_rows_of_another_size_than_described_are_left_out(packing: str, tmp_path: Path) -> None:
    path = packed(tmp_path / "log.mcap", [["y", "float64", [2], "m"]], size=8, packing=packing)
    assert read_log(path)["c.y"].shape == (0, 2)
    path = packed(tmp_path / "log.mcap", [["y", "float64", [2], "m"]], size=16, packing=packing)
    assert read_log(path)["c.y"].shape == (3, 2)


BOUNDED = """
import resource, sys
from quadvis.errors import QuadvisError
from quadvis.output.log_reader import read_log
import zstandard, lz4.frame, numpy
taken = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (taken + (50 << 20),) * 2)
for path in sys.argv[1:]:
    try:
        log = read_log(path)
        print(log.damage or "whole")
    except QuadvisError as error:
        print(error)
"""
LENGTHS = [0, 1, 5, 1 << 22, 1 << 31, 1 << 40, (1 << 63) - 1, (1 << 64) - 1]

linux = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="looks at the memory in /proc")


def read_within_50_megabytes(paths: list[Path]) -> list[str]:
    """Read logs in a process that cannot take more memory than so much, and return what it says of each."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", BOUNDED, *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.splitlines()) == len(paths)
    return done.stdout.splitlines()


FIELDS = [["y", "float64", [1 << 20], "m"]]


@linux
@pytest.mark.parametrize("count", mostly_slow([10, 40]))
def test_a_small_file_that_unpacks_to_a_large_one_takes_no_memory(count: int, tmp_path: Path) -> None:
    paths = [
        packed(tmp_path / f"{packing}.mcap", FIELDS, 8 << 20, count, packing) for packing in ("LZ4", "ZSTD")
    ]
    assert all("is damaged in 1 place" in words for words in read_within_50_megabytes(paths))
    assert paths[1].stat().st_size < 100_000  # of 80 or 320 MB


@linux
@pytest.mark.slow
@pytest.mark.parametrize("packing", ["LZ4", "ZSTD"])
def test_a_million_rows_without_a_byte_take_no_memory(packing: str, tmp_path: Path) -> None:
    (words,) = read_within_50_megabytes([packed(tmp_path / "many.mcap", FIELDS, 0, 1_000_000, packing)])
    assert "is damaged in 1 place" in words or words == "whole"


@linux
def test_a_chunk_that_lies_about_its_size_is_left_out(tmp_path: Path) -> None:
    paths = []
    for packing in ("LZ4", "ZSTD"):
        path = packed(tmp_path / f"{packing}.mcap", [["y", "float64", [], "m"]], 8, 100, packing)
        data = bytearray(path.read_bytes())
        place = data.index(packing.lower().encode()) - 4 - 4 - 8
        for length in LENGTHS:
            data[place : place + 8] = length.to_bytes(8, "little")
            paths.append(tmp_path / f"{packing}-{length}.mcap")
            paths[-1].write_bytes(data)
    assert all("is damaged in 1 place" in words for words in read_within_50_megabytes(paths))


@linux
def test_an_absurd_length_is_damage_and_takes_no_memory(tmp_path: Path, whole: bytes) -> None:
    name = whole.index(b"diagram.yaml")
    places = {
        "attachment": (name - 4 - 16 - 8, 8),
        "name": (name - 4, 4),
        "metadata": (whole.index(b"\x07\0\0\0quadvis", name) - 8, 8),
        "chunk": (chunks(whole)[2][0] + 1, 8),
    }
    paths = []
    for key, (place, width) in places.items():
        for length in LENGTHS:
            data = bytearray(whole)
            data[place : place + width] = (length % (1 << 8 * width)).to_bytes(width, "little")
            paths.append(tmp_path / f"{key}-{length}.mcap")
            paths[-1].write_bytes(data)
    said = read_within_50_megabytes(paths)
    assert all("damaged" in words or "was not written by quadvis" in words for words in said)


# anything at all


def survives(path: Path, data: bytes) -> None:
    """Read what was made of a log: either a log whose signals can be looked at, or a sentence."""
    path.write_bytes(data)
    try:
        log = read_log(path)
        for name in log.names:
            assert len(log[name]) == len(log.times(name))
    except QuadvisError as error:
        assert "\n" not in str(error)
    assert isinstance(log_facts(path), dict)


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory, whole: bytes) -> list[bytes]:
    """Return a log of this program and the same as other tools pack it."""
    path = tmp_path_factory.mktemp("kinds") / "log.mcap"
    fields = [["y", "float64", [2], "m"]]
    return [whole, *(packed(path, fields, 16, 50, packing).read_bytes() for packing in ("LZ4", "ZSTD"))]


@pytest.mark.faults
@pytest.mark.parametrize("kind", range(3))
def test_every_truncation_is_a_log_or_a_sentence(kind: int, kinds: list[bytes], tmp_path: Path) -> None:
    for size in range(0, len(kinds[kind]), 97):
        survives(tmp_path / "log", kinds[kind][:size])


@pytest.mark.faults
@given(
    kind=st.integers(0, 2),
    flips=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(1, 255)), min_size=1, max_size=8),
    cut=st.floats(0.2, 1),
)
def test_flipped_bits_and_a_cut_give_a_log_or_a_sentence(
    kinds: list[bytes],
    tmp_path_factory: pytest.TempPathFactory,
    kind: int,
    flips: list[tuple[float, int]],
    cut: float,
) -> None:
    data = bytearray(kinds[kind])
    for place, bits in flips:
        data[int(place * len(data))] ^= bits
    survives(tmp_path_factory.getbasetemp() / "flipped", bytes(data[: int(cut * len(data))]))


@pytest.mark.faults
@given(
    words=st.lists(
        st.sampled_from([b"\x06", b"\0\0\0", b"zstd", b"\xff", b"quadvis", b"\x0c\x07"]), max_size=60
    )
)
def test_words_of_the_format_in_any_order_give_a_sentence(
    tmp_path_factory: pytest.TempPathFactory, words: list[bytes]
) -> None:
    survives(tmp_path_factory.getbasetemp() / "words", b"\x89MCAP0\r\n" + b"".join(words))


def test_the_command_says_what_is_missing_and_draws_the_rest(
    tmp_path: Path, whole: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[: chunks(whole)[3][0]])
    assert main(["plot", str(path)]) == 0
    told = capsys.readouterr()
    assert told.err == f"the log '{path}' is cut short; what is left of it goes to 2.9 s\n"
    assert told.out.endswith("1-one.png\n")


def test_a_pipe_in_place_of_a_log_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(QuadvisError, match=r"cannot read the log .*a device or a pipe"):
        read_log(tmp_path / "pipe")
