"""Profiles: every call is counted, alike in both engines, and the trace is one that Chrome reads."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from quadvis.api import load_text
from quadvis.cli import main
from quadvis.engine import profile
from quadvis.engine.engine import Engine
from quadvis.engine.profile import Profile, ProfileReport, Timed, TimedMethod, record
from quadvis.errors import RunError
from quadvis.native.choice import choose, use
from quadvis.run.report import profile_lines
from tests.stages import mostly_slow

TEXT = """\
quadvis: 1
name: timed
rates: {fast: 100 Hz, slow: 20 Hz}
stop_time: 0.5 s
blocks:
  wave: {block: sources.sine, rate: fast}
  lag:
    block: signal.low_pass
    rate: slow
    with: {time_constant: 1 s}
    in: {u: {from: wave.y, across: sample}}
"""


@pytest.mark.parametrize("kind", mostly_slow(["python", "native"]))
def test_every_call_of_a_block_is_counted_and_the_signals_stay(kind: str) -> None:
    diagram = load_text(TEXT)
    plain = diagram.run(engine=kind)
    result = diagram.run(engine=kind, profile=True)
    assert {name: result[name].tobytes() for name in result} == {
        name: plain[name].tobytes() for name in plain
    }
    (report,) = result.profiles.values()
    assert {(each.block, each.method): each.calls for each in report.methods} == {
        ("wave", "output"): 51, ("lag", "output"): 11, ("lag", "update"): 11,
    }  # fmt: skip
    assert {each.block: each.task for each in report.methods} == {"wave": "fast", "lag": "slow"}
    for each in report.methods:
        assert 0 <= each.least <= each.total / each.calls <= each.most
    assert len(report.calls) == 73
    assert [begin for _, begin, _ in report.calls] == sorted(begin for _, begin, _ in report.calls)
    first = [report.methods[place] for place, _, _ in report.calls[:3]]
    assert [(each.block, each.method) for each in first] == [
        ("wave", "output"), ("lag", "output"), ("lag", "update"),
    ]  # fmt: skip
    assert report.cost > 0


@pytest.mark.parametrize("kind", mostly_slow(["python", "native"]))
def test_a_call_that_fails_fails_as_without_a_profile(kind: str) -> None:
    engine = Engine(load_text(TEXT).graph)
    engine.measure()
    use(engine, choose(engine, 0, kind))
    with engine:
        engine.write("lag", "time_constant", float("nan"))
        with pytest.raises(RunError, match="the output became nan"):
            engine.run(51)


def test_calls_beyond_the_room_are_counted_and_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(profile, "EVENTS", 2)
    made = Profile(8)
    made.begin(1)
    number, words = made.words(7, "output")
    for begin, taken in ((5, 30), (40, 10), (60, 20)):
        record(words, made.events, number, begin, taken)
    report = ProfileReport.of([(made, [TimedMethod("far.gain", "output", "fast")])], 1)
    assert report is not None
    assert report.methods == (Timed("far.gain", "output", "fast", 3, 60e-9, 10e-9, 30e-9),)
    assert (report.calls, report.first) == (((0, 0, 30), (0, 35, 10)), 5)


def test_a_report_is_of_one_measurement() -> None:
    """A thread that has not seen a new one yet still has the numbers of the one before."""
    made, named = Profile(1), [TimedMethod("gain", "output", "fast")]
    number, words = made.words(0, "output")

    def calls(measurement: int) -> int | None:
        report = ProfileReport.of([(made, named)], measurement)
        return None if report is None else report.methods[0].calls

    made.begin(1)
    assert calls(1) is None  # nothing has been called
    record(words, made.events, number, 1, 1)
    assert [calls(1), calls(2), calls(3), calls(4)] == [1, 1, None, None]
    made.begin(2)
    assert [calls(1), calls(2), calls(3)] == [1, 1, None]
    made.begin(3)
    assert calls(3) is None
    record(words, made.events, number, 1, 1)
    assert [calls(2), calls(3), calls(4)] == [None, 1, 1]


def test_1_call_in_100_takes_longer_than_p99() -> None:
    methods = tuple(Timed(block, "output", "fast", 1000, 1e-3, 1e-6, 1e-3) for block in ("a", "b"))
    calls = tuple((place, 0, (number + 1) * 1000) for number in range(1000) for place in (0, 1))
    _, head, *rows = profile_lines("", ProfileReport(methods, (*calls, (0, 0, 10**9)), 1e-6))
    place = head.split().index("p99")
    assert [row.split()[2 * place - 2] for row in rows] == ["991", "990"]


def test_the_command_prints_a_table_and_writes_a_trace(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("timed.yaml").write_text(TEXT)
    assert main(["run", "timed.yaml", "--log", "", "--profile", "trace.json", "--engine", "python"]) == 0
    lines = capsys.readouterr().out.splitlines()
    start = next(number for number, line in enumerate(lines) if "profile: every call timed" in line)
    assert lines[start + 1].split() == ["block", "calls", "min", "mean", "p99", "max", "share"]
    rows = [line.split() for line in lines[start + 2 : start + 4]]
    assert {row[0]: row[1] for row in rows} == {"wave": "51", "lag": "22"}
    assert sum(float(row[-2]) for row in rows) == pytest.approx(100, abs=0.2)
    trace = json.loads(Path("trace.json").read_text())["traceEvents"]
    names = {event["tid"]: event["args"]["name"] for event in trace if event["name"] == "thread_name"}
    calls = [event for event in trace if event["ph"] == "X"]
    assert len(calls) == 73
    assert {(event["name"], names[event["tid"]]) for event in calls} == {
        ("wave.output", "fast"), ("lag.output", "slow"), ("lag.update", "slow"),
    }  # fmt: skip
    assert all(event["dur"] >= 0 and event["ts"] >= 0 for event in calls)
    assert main(["run", "timed.yaml", "--log", "", "--profile", ""]) == 0
    assert "profile: " in capsys.readouterr().out


@pytest.mark.parametrize("place", ["missing/trace.json", "timed.yaml", "notes.json"])
def test_a_place_where_no_trace_can_go_is_refused_before_the_run(
    place: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("timed.yaml").write_text(TEXT)
    Path("notes.json").write_text("{}")
    assert main(["run", "timed.yaml", "--profile", place]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"cannot write the trace '{place}': ")
    assert not Path("runs").exists()
