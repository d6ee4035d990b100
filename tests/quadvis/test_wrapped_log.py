"""Logs of bounded length: of a long run they have the newest rows, each once, in two files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import RunError
from quadvis.output.log_reader import read_log
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.output.wrapped_log import WrappedLog, before

TICK = 10_000_000  # ns
BLOCKS = (RecordedBlock("/a", (RecordedPort("y"),)), RecordedBlock("/b", (RecordedPort("y"),)))


def written(path: Path, span: int, pieces: list[int]) -> int:
    """Write rows of two blocks, the second one at every third tick, so many ticks at a time."""
    log = WrappedLog(path, BLOCKS, {"diagram": ""}, span * TICK)
    tick = 0
    with log:
        for count in pieces:
            ticks = np.arange(tick, tick + count)
            tick += count
            for block, rows in enumerate((ticks, ticks[ticks % 3 == 0])):
                log.write_rows(block, rows * TICK, (rows + 0.5 * block).reshape(-1, 1).view(np.int64))
            log.flush_late()
        log.close({"passed": "true"})
    assert log.loss == ""
    return log.wraps


@given(st.integers(1, 30), st.lists(st.integers(0, 12), max_size=30))
def test_the_newest_rows_are_there_once(
    tmp_path_factory: pytest.TempPathFactory, span: int, pieces: list[int]
) -> None:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    wraps = written(path, span, pieces)
    parts = [read_log(each) for each in (before(path), path) if each.exists()]
    assert len(parts) == min(1 + wraps, 2) and all(each.complete for each in parts)
    total = sum(pieces)
    a, b = (np.concatenate([each[name] for each in parts]) for name in ("a.y", "b.y"))
    np.testing.assert_array_equal(a, np.arange(total)[total - len(a) :])
    assert len(a) == total or len(a) >= span
    assert len(a) <= 2 * (span + max(pieces, default=0))
    np.testing.assert_array_equal(b, [tick + 0.5 for tick in a if tick % 3 == 0])
    assert parts[-1].summary["passed"] == "true"
    assert parts[-1].metadata.get("wraps", "0") == str(wraps)


def test_a_run_survives_a_new_part_that_the_disk_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.mcap"
    log = WrappedLog(path, BLOCKS, {"diagram": ""}, 2 * TICK)

    def refuse(*_: object) -> None:
        raise RunError("no space is left")

    row = np.zeros(1).tobytes()
    for tick in range(4):
        log.write(0, tick * TICK, row)
    monkeypatch.setattr("quadvis.output.wrapped_log.LogWriter", refuse)
    log.flush_late()
    for tick in range(4, 8):
        log.write(0, tick * TICK, row)
        log.write_change(tick, "a", "gain", 2.0)
        log.flush_late()
    log.close()
    assert "the log has ended: no space is left" in log.loss
    assert len(read_log(before(path))["a.y"]) == 4


def test_a_part_of_an_older_run_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    before(path).write_text("of an older run")
    written(path, 10, [3])
    assert not before(path).exists()
