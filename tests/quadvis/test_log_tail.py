"""The end of a log that its writer could not write: wherever it is cut, each row is there once afterwards."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.output.log import LogWriter
from quadvis.output.log_reader import read_log
from quadvis.output.log_tail import add_tail
from quadvis.output.recording import RecordedBlock, RecordedPort
from tests.processes import linux

pytestmark = linux

QUICK = RecordedBlock("/quick", (RecordedPort("y"), RecordedPort("number", "int64")))
RARE = RecordedBlock("/rare", (RecordedPort("y"),))
METADATA = {"diagram": "quadvis: 1\n", "name": "cut"}
ROWS, EVERY = 60, 20  # of the quick block; one row of the rare one for so many
STAMPS = np.arange(ROWS) * 10**6
QUICK_ROWS = np.column_stack((np.arange(ROWS).astype(float).view(np.int64), np.arange(ROWS)))
RARE_ROWS = QUICK_ROWS[::EVERY, :1].copy()
ALL = {
    "/quick": (STAMPS, QUICK_ROWS),
    "/rare": (STAMPS[::EVERY], RARE_ROWS),
    "/unknown": (STAMPS, QUICK_ROWS),
}


def whole(path: Path, flushed: int) -> bytes:
    """Return the bytes of a log that holds so many rows, in several chunks, and has no end."""
    writer = LogWriter(path, [QUICK, RARE], METADATA)
    for first in range(0, flushed, 7):
        some = slice(first, min(first + 7, flushed))
        writer.write_rows(0, STAMPS[some], QUICK_ROWS[some])
        rare = [number for number in range(ROWS)[some] if number % EVERY == 0]
        if rare:
            writer.write_rows(1, STAMPS[rare], QUICK_ROWS[rare, :1])
        writer.flush()
    writer._sink.drain()
    data = path.read_bytes()
    writer.close()
    return data


def check(path: Path, rows: int = ROWS) -> None:
    log = read_log(path)
    assert log["quick.number"].tolist() == list(range(rows))
    assert log.stamps("quick.y").tolist() == STAMPS[:rows].tolist()
    assert log["rare.y"].tolist() == list(range(0, rows, EVERY))
    assert "is cut short" in log.damage and "is damaged in" not in log.damage


@pytest.fixture(scope="module")
def cut_from(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes, int]:
    """Return a path, the bytes of a log with most rows, and where its rows begin."""
    path = tmp_path_factory.mktemp("tail") / "run.mcap"
    return path, whole(path, 45), len(whole(path, 7))


@settings(max_examples=60)
@given(st.data())
def test_wherever_it_is_cut_all_rows_are_there_once(
    cut_from: tuple[Path, bytes, int], data: st.DataObject
) -> None:
    path, contents, begin = cut_from
    path.write_bytes(contents[: data.draw(st.integers(begin, len(contents)))])
    before = len(read_log(path)["quick.y"])
    added = add_tail(path, ALL)
    check(path)
    assert added >= ROWS - before
    assert add_tail(path, ALL) == 0
    check(path)


def test_what_is_there_stays_and_a_log_without_a_row_has_no_topics(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(whole(path, 45))
    assert add_tail(path, {}) == 0
    check(path, 45)
    path.write_bytes(whole(path, 0))
    assert add_tail(path, ALL) == 0


def test_several_add_at_the_same_time(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(whole(path, 45))
    with ThreadPoolExecutor() as pool:
        added = pool.map(lambda topic: add_tail(path, {topic: ALL[topic]}), ["/quick", "/rare"])
    assert sum(added) == ROWS - 45
    check(path)


def test_what_is_no_log_without_an_end_stays_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    whole(path, 45)
    ended = path.read_bytes()
    with pytest.raises(ValueError, match="its end"):
        add_tail(path, ALL)
    assert path.read_bytes() == ended
    path.write_bytes(os.urandom(1000))
    with pytest.raises(ValueError, match="begin"):
        add_tail(path, ALL)
