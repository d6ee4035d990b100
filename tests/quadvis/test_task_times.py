"""The times of tasks in a log: to be had by their names, and no signals of the diagram."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.diff.signals import compare_signals
from quadvis.errors import QuadvisError
from quadvis.output.log import LogWriter
from quadvis.output.log_reader import Log, read_log
from quadvis.output.plot import plot_times
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.run.logged_notes import LoggedNotes

TEXT = """\
quadvis: 1
name: timed
rates: {fast: 100 Hz, slow: 10 Hz}
stop_time: 1 s
blocks:
  wave: {block: sources.sine, rate: fast}
  still: {block: sources.sine, rate: slow}
"""
WAVE = RecordedBlock("/wave", (RecordedPort("y"),), "fast")


def written(path: Path, rows: dict[str, list[list[int]]], computer: str = "target") -> Log:
    graph = load_text(TEXT).graph
    notes = LoggedNotes({computer: graph}, 1, measured=True)
    with LogWriter(path, [WAVE, *notes.blocks], {"name": "timed"}) as writer:
        taker = notes.taker(writer)
        writer.write(0, 0, np.float64(7.0).tobytes())
        for task, records in rows.items():
            taker.times(computer, task, np.array(records, np.int64).reshape(-1, 4))
    return read_log(path)


ROWS = {"fast": [[0, 1500, 20_000, 0], [3, 0, 10**9, 2]], "slow": [[10, 5, 6, 0]]}


def test_times_have_the_stamps_of_their_tasks_ticks_and_units(tmp_path: Path) -> None:
    log = written(tmp_path / "run.mcap", ROWS)
    name = "_times/target/fast"
    np.testing.assert_allclose(log[f"{name}.lateness"], [1.5e-6, 0.0])
    np.testing.assert_allclose(log[f"{name}.tet"], [2e-5, 1.0])
    assert log[f"{name}.overruns"].tolist() == [0, 2]
    assert log.times(f"{name}.tet").tolist() == [0.0, 0.03]
    assert log.stamps("_times/target/slow.tet").tolist() == [100_000_000]
    assert (log.port(f"{name}.tet").unit, log.rate(f"{name}.tet")) == ("s", "fast")
    assert f"{name}.tet" in log and f"{name}.other" not in log


def test_without_computers_the_name_has_none(tmp_path: Path) -> None:
    assert written(tmp_path / "run.mcap", ROWS, "")["_times/slow.lateness"].tolist() == [5e-9]


def test_they_are_no_signals_and_nothing_for_comparisons(tmp_path: Path) -> None:
    log, other = (
        written(tmp_path / "run.mcap", ROWS),
        written(tmp_path / "other.mcap", {"slow": ROWS["slow"]}),
    )
    assert log.names == ("wave.y",) and [block.path for block in log.blocks] == ["/wave"]
    assert not any(name.startswith("_times") for name in log.hidden.names)
    assert not compare_signals(log, other)


def test_they_are_drawn_on_request(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = written(tmp_path / "run.mcap", ROWS)
    drawn: list[Any] = []
    monkeypatch.setattr("quadvis.output.plot._draw", lambda *given: drawn.append(given))
    names = [path.name for path in plot_times(log)]
    assert names == ["1-_times-target-fast.png", "2-_times-target-slow.png"] and len(drawn) == 2
    with pytest.raises(QuadvisError, match="has no times of tasks; only a real-time run has them"):
        plot_times(Log(tmp_path / "empty.mcap"))
