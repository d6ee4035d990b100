"""Runs held by hand: `with diagram.start() as run`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.api import load_text
from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.run.live import LiveRun

TEXT = """
quadvis: 1
name: live
rates: {base: 10 Hz, slow: 5 Hz}
stop_time: 1 s
blocks:
  ramp: {block: sources.sine, rate: base, with: {amplitude: 2 m, frequency: 0.25 Hz}}
  law: {block: signal.gain, rate: base, with: {factor: 2 1/s}, in: {u: ramp.y}}
  held: {block: signal.unit_delay, rate: slow, in: {u: {from: law.y, across: sample}}}
"""


@pytest.fixture
def run() -> Iterator[LiveRun]:
    with load_text(TEXT).start() as run:
        yield run


def test_it_advances_by_durations_and_by_single_ticks(run: LiveRun) -> None:
    assert run.time == 0.0
    run.advance("0.3 s")
    assert run.time == pytest.approx(0.3)
    run.advance(0.05)
    assert run.time == pytest.approx(0.4)
    run.advance(0.05)
    assert run.time == pytest.approx(0.4)
    run.advance()
    assert run.time == pytest.approx(0.5)


def test_signals_are_those_of_a_whole_run() -> None:
    whole = load_text(TEXT).run()
    with load_text(TEXT).start() as run:
        for k in range(11):
            run.advance()
            assert run["law.y"] == whole["law.y"][k]


def test_a_tuned_parameter_counts_from_the_next_tick(run: LiveRun) -> None:
    run.advance("0.5 s")
    before = run["law.y"] / run["ramp.y"]
    run["law.factor"] = "180 1/min"
    assert run["law.factor"] == 2.0
    run.advance()
    assert before == pytest.approx(2.0) and run["law.y"] / run["ramp.y"] == pytest.approx(3.0)
    (change,) = run.changes
    assert (change.tick, change.path, change.name, change.value) == (5, "law", "factor", 3.0)
    run["law.factor"] = 1.5
    run.advance()
    assert run["law.y"] / run["ramp.y"] == pytest.approx(1.5)


def test_a_snapshot_is_gone_back_to(run: LiveRun) -> None:
    run.advance("0.4 s")
    kept = run.snapshot()
    first: list[Any] = []
    for found in (first, []):
        for _ in range(4):
            run.advance("0.1 s")
            found.append((run.time, run["held.y"]))
        run.restore(kept)
    assert found == first


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("law.factor", "3 m", "law.factor: .*3 m.*1/s"),
        ("law.facto", 1.0, "block 'law' has no 'facto'; did you mean 'factor'"),
        ("lwa.factor", 1.0, "this run has no 'lwa.factor'; did you mean 'law.factor'"),
        ("law.y", 1.0, "'law.y' is no parameter"),
        ("held.initial", 1.0, "cannot be tuned|no parameter that can be tuned"),
        ("law.factor[0]", 1.0, "give all of it"),
        ("law", 1.0, "this run has no 'law'"),
    ],
)
def test_what_cannot_be_set_is_refused_in_words(run: LiveRun, name: str, value: Any, words: str) -> None:
    with pytest.raises(QuadvisError, match=words):
        run[name] = value


def test_parts_and_elements_have_their_names() -> None:
    folder = Path(__file__).parents[2] / "diagrams"
    with quadvis.load(folder / "hover.yaml", variant="geometric").start() as run:
        run.advance("0.2 s")
        position = run["craft.position"]
        assert position.shape == (3,) and run["craft.position[2]"] == position[2]
        assert np.array_equal(run["craft.position[0:2]"], position[:2])
        run["control/roll.bandwidth"] = "3 rad/s"
        run.advance("0.1 s")
        assert run["control/roll.bandwidth"] == 3.0


def test_the_program_is_printed(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "live.yaml").write_text(TEXT)
    assert main(["program", str(tmp_path / "live.yaml")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("live: base tick 100 ms, ode4, single tasking, 3 blocks")
    assert any(line.split() == ["output", "1", "law", "ramp.y", "->", "y"] for line in lines)
    assert any(line.strip().startswith("law.factor") for line in lines)


def test_a_run_by_hand_writes_the_log_of_a_whole_run(tmp_path: Path) -> None:
    whole = load_text(TEXT).run()
    with load_text(TEXT).start(log=tmp_path / "run.mcap") as run:
        run.advance("0.5 s")
        with pytest.raises(QuadvisError, match="a run that writes a log cannot go back"):
            run.restore(run.snapshot())
        run.advance("0.6 s")
    log = quadvis.read_log(tmp_path / "run.mcap")
    assert log.complete and "stopped" not in log.summary
    assert all(log[name].tobytes() == whole[name].tobytes() for name in whole)


def test_the_log_of_a_run_that_was_ended_early_says_so(tmp_path: Path) -> None:
    with load_text(TEXT).start(log=tmp_path / "run.mcap") as run:
        run.advance("0.5 s")
    assert quadvis.read_log(tmp_path / "run.mcap").summary == {"stopped": "it was ended at t = 0.5 s"}
