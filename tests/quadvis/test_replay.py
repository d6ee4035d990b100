"""Runs repeated from their logs, to the bit; and logs that differ, are cut, or lack what is needed."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis import read_log, replay
from quadvis.cli import main
from quadvis.errors import DiagramError, QuadvisError
from tests.quadvis.relogged import TEXT, Edit, Rows, flipped, flown, rewritten, without, write_flight

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_flight()


@pytest.mark.parametrize("engine", ["python", pytest.param("native", marks=pytest.mark.slow)])
def test_a_hover_is_the_same_to_the_bit(engine: str, capsys: pytest.CaptureFixture[str]) -> None:
    diagram = quadvis.load(ROOT / "diagrams/hover.yaml", variant="geometric", stop_time=2.0)
    diagram.run(log="hover.mcap", engine="python")
    assert main(["replay", "hover.mcap", "--engine", engine]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "replayed 401 ticks: the same to the bit"


def test_what_came_from_outside_comes_from_the_log() -> None:
    log = flown()
    assert "outside.y" in log.names and len(log["outside.y"]) == 16  # as the diagram wants it
    assert log.hidden.names == ("_replay/inputs/outside.y", "_replay/inputs/outside.even")
    assert len(log.hidden["_replay/inputs/outside.y"]) == 61
    Path("world").write_text("1000")
    found = replay("run.mcap")
    assert found.same and found.whole
    assert (found.ticks, found.played, found.time) == (61, ("outside",), 2.0)
    assert Path("world").read_text() == "1000"
    assert found.signals == 4 and found.rows == 3 * 16 + 21


def test_rows_that_are_all_logged_are_not_written_twice() -> None:
    Path("flight.yaml").write_text(TEXT.replace("log: {every: {fast: 4}}\n", ""))
    assert not flown().hidden.names
    assert replay("run.mcap").same


def test_a_block_that_is_not_logged_is_recorded_all_the_same() -> None:
    Path("flight.yaml").write_text(TEXT.replace("{every: {fast: 4}}", "{signals: [slow]}"))
    log = flown()
    assert log.names == ("slow.y",)
    assert replay("run.mcap").same


def test_a_flipped_bit_is_found_and_named(capsys: pytest.CaptureFixture[str]) -> None:
    log = rewritten(flown(), flipped("/filter", 5, 0))
    old, new = log["filter.y"][5], read_log("run.mcap")["filter.y"][5]
    assert main(["replay", "new.mcap"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert "replayed 61 ticks: 1 of 4 signals differ" in lines
    where = "filter.y at tick 20, t = 0.666666667 s"
    assert f"  first {where}: {float(old)!r} m in the log, {float(new)!r} m in the replay" in lines
    assert main(["replay", "new.mcap", "--json"]) == 1
    facts = json.loads(capsys.readouterr().out)
    (difference,) = facts["differences"]
    assert (facts["same"], difference["tick"], difference["different_rows"]) == (False, 20, 1)


def test_the_first_difference_is_that_of_the_first_tick() -> None:
    log = flown()
    twice = rewritten(rewritten(log, flipped("/filter", 9, 0)), flipped("/slow", 11, 0), path="twice.mcap")
    found = replay(twice)
    assert [each.difference.signal for each in found.differences] == ["slow.y", "filter.y"]
    assert [each.tick for each in found.differences] == [33, 36]


def test_a_damaged_byte_is_no_row_of_another_run() -> None:
    flown()
    data = bytearray(Path("run.mcap").read_bytes())
    row = read_log("run.mcap").arrays("/slow")[1][3].tobytes()
    data[data.index(row)] ^= 1
    Path("run.mcap").write_bytes(data)
    with pytest.raises(QuadvisError, match=r"holds no row that|lacks the outputs of 'outside'"):
        replay("run.mcap")


def test_a_row_that_a_whole_log_lacks_is_a_difference(capsys: pytest.CaptureFixture[str]) -> None:
    rewritten(flown(), without("/slow", 4, 5))
    assert main(["replay", "new.mcap"]) == 1
    assert "  the log lacks 2 rows of slow, the first at t = 0.4 s" in capsys.readouterr().out.splitlines()


def test_a_log_that_is_cut_is_replayed_as_far_as_it_goes(capsys: pytest.CaptureFixture[str]) -> None:
    def cut(path: str, stamps: Rows, slots: Rows) -> tuple[Rows, Rows]:
        count = 42 if path == "/_replay/inputs/outside" else np.searchsorted(stamps, 1_500_000_001)
        return stamps[:count], slots[:count]

    rewritten(flown(), cut, summary={"stopped": "it was told to end"})
    assert main(["replay", "new.mcap", "-o", "again.mcap"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1] == "  the log does not have the whole run: it was told to end"
    end = "up to t = 1.36666667 s, as far as the log goes"
    assert lines[-2] == f"replayed 42 ticks, {end}: the same to the bit"
    again = replay("again.mcap")
    assert again.same and not again.whole and again.ticks == 42


@pytest.mark.parametrize(
    "edit, words",
    [
        (without("/_replay/inputs/outside", 7), "lacks the outputs of 'outside' at t = 0.233333333 s"),
        (without("/_replay/inputs/outside", 60), "lacks the outputs of 'outside' at t = 2 s"),
    ],
)
def test_a_lack_of_what_came_from_outside_is_said(edit: Edit, words: str) -> None:
    log = rewritten(flown(), edit)
    with pytest.raises(QuadvisError, match=words):
        replay(log)


def test_a_log_of_an_earlier_version_says_what_it_lacks() -> None:
    log = flown()
    log.hidden = quadvis.output.recording.Recording()
    words = "does not hold all outputs of 'outside', which come from outside; run the diagram again"
    with pytest.raises(QuadvisError, match=words):
        replay(log)
    Path("flight.yaml").write_text(
        TEXT.replace("  outside: {block: own.outside, rate: fast}\n", "").replace("outside.y", "0 m")
    )
    log = flown()
    assert replay(log).same
    log.metadata["clock"] = "real time"
    with pytest.raises(QuadvisError, match="does not say which ticks the real-time run left out"):
        replay(log)


def test_with_a_replaced_parameter_what_came_from_outside_stays(capsys: pytest.CaptureFixture[str]) -> None:
    flown()
    assert main(["replay", "run.mcap", "--set", "filter.time_constant=0.1 s", "-o", "new.mcap"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "flight: seed 7, simulated, with filter.time_constant=0.1 s"
    assert "replayed 61 ticks: 2 of 4 signals differ" in lines
    old, new = read_log("run.mcap"), read_log("new.mcap")
    assert new.complete and new.metadata["replay of"] == "run.mcap"
    assert old["outside.y"].tobytes() == new["outside.y"].tobytes()
    largest = np.abs(new["filter.y"] - old["filter.y"]).max()
    assert any(line.split()[:1] == ["filter.y"] and f"by {largest:.3g} m" in line for line in lines)
    assert replay(new).same  # the new log can be replayed in turn
    with pytest.raises(DiagramError, match="no block 'fliter'") as caught:
        replay(old, settings=["fliter.time_constant=0.1 s"])
    assert not getattr(caught.value, "__notes__", [])  # no other folder would help


def test_the_log_itself_is_not_written_over(capsys: pytest.CaptureFixture[str]) -> None:
    flown()
    before = Path("run.mcap").read_bytes()
    assert main(["replay", "run.mcap", "-o", "run.mcap"]) == 2
    assert "it is an input" in capsys.readouterr().err
    assert Path("run.mcap").read_bytes() == before


def test_a_new_log_that_the_disk_refuses_does_not_hide_the_result(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    flown()
    monkeypatch.setattr("quadvis.output.log.LogWriter.loss", "the disk is full")
    assert main(["replay", "run.mcap", "-o", "new.mcap"]) == 1
    out, err = capsys.readouterr()
    assert "the same to the bit" in out and err.endswith("\nthe disk is full\n")


def test_parameters_that_were_tuned_are_tuned_again() -> None:
    with quadvis.load("flight.yaml").start(log="run.mcap") as run:
        run.advance("0.5 s")
        run["filter.time_constant"] = "0.05 s"
        run.advance("1 s")
        run["noise.sigma"] = "0 m"
        run["filter.time_constant"] = "1 s"
        run.advance("0.5 s")
    log = read_log("run.mcap")
    assert [int(change["tick"]) for change in log.changes] == [15, 45, 45]
    found = replay(log, output="new.mcap")
    assert found.same and found.ticks == 60
    assert read_log("new.mcap").changes == log.changes
    log.changes.pop()
    (first, *_) = replay(log).differences
    assert (first.difference.signal, first.tick) == ("filter.y", 48)


@pytest.mark.parametrize("ticks, turns", [(100, 3), pytest.param(1000, 10, marks=pytest.mark.slow)])
def test_the_bits_do_not_depend_on_how_fast_it_goes(
    ticks: int, turns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of many stamps is that of rows of three topics: ticks and order count, and no clock."""
    text = TEXT.replace("30 Hz, slow: 10 Hz", "1 kHz, slow: 1 kHz").replace(
        "stop_time: 2 s", f"stop_time: {(ticks - 1) / 1000} s"
    )
    Path("flight.yaml").write_text(text.replace("{every: {fast: 4}}", "{signals: [sum, filter, slow]}"))
    log = flown()
    names = ("sum.y", "filter.y", "slow.y")
    assert len({log.stamps(name).tobytes() for name in names}) == 1 and len(log["slow.y"]) == ticks
    seen = set()
    for turn in range(turns):
        monkeypatch.setattr("quadvis.run.loops.SLICE", (0.0, 0.001, 10.0)[turn % 3])
        assert replay(log, output="new.mcap").same
        new = read_log("new.mcap")
        seen.add(hashlib.sha256(b"".join(new[name].tobytes() for name in names)).hexdigest())
    assert len(seen) == 1


@pytest.mark.parametrize(
    "change",
    [{"tick": "1"}, {"tick": "soon", "block": "noise", "parameter": "sigma", "value": "1"},
     {"tick": "1", "block": "noise", "parameter": "sigma", "value": "{"}],
)  # fmt: skip
def test_a_change_that_says_nothing_is_refused(change: dict[str, str]) -> None:
    log = flown()
    log.changes.append(change)
    with pytest.raises(
        QuadvisError, match="describes a change of a parameter in a way that this quadvis does"
    ):
        replay(log)


def test_a_log_without_rows_or_diagram_is_refused() -> None:
    log = flown()
    log.diagram = ""
    with pytest.raises(QuadvisError, match="holds no diagram"):
        replay(log)
    empty = rewritten(flown(), lambda path, stamps, rows: (stamps[:0], rows[:0]), {"stopped": "early"})
    with pytest.raises(QuadvisError, match="holds no row that a replay could repeat"):
        replay(empty)
