"""Real-time runs that are steered: begun, tuned, stopped, and repeated from their logs."""

from __future__ import annotations

import math
import os
import signal
import sys
import time
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from quadvis import read_log, replay
from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.engine.tuning import NewValue
from quadvis.errors import DiagramError, QuadvisError, RunError
from quadvis.realtime.helm import ENDLESS, Helm
from quadvis.realtime.note_taker import NoteTaker
from quadvis.run.loops import Paced, Takers
from tests.processes import children, wait_for
from tests.quadvis.realtime.steered import CALM, Steered

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")

TEXT = """\
quadvis: 1
name: flight
rates: {fast: 200 Hz, slow: 50 Hz}
solver: {method: ode4, step: 5 ms}
stop_time: 60 s
seed: 7
overload: {action: warn}
blocks:
  noise: {block: sources.noise, rate: fast, with: {sigma: 1 m}}
  ramp: {block: sources.ramp, rate: fast, with: {slope: 1 m/s}}
  law: {block: signal.gain, rate: fast, with: {factor: 2}, in: {u: noise.y}}
  integral: {block: signal.integrator, in: {u: {from: law.y, across: hold}}}
  back: {block: signal.gain, rate: slow, with: {factor: 3}, in: {u: {from: law.y, across: sample}}}
expect:
  - {signal: ramp.y, before: 50 ms, within: 1 m}
"""
MULTI = TEXT.replace("seed: 7", "seed: 7\ntasking: multi")
LINK = "computers: {near: {}, far: {}}\nlinks: {line: {from: near, to: far, via: memory}}"


def on_two_computers() -> str:
    text = (
        TEXT.replace("seed: 7", f"seed: 7\n{LINK}")
        .replace(", across: hold", "")
        .replace(", across: sample", "")
    )
    for block, computer in {
        "noise": "near",
        "ramp": "near",
        "law": "near",
        "integral": "far",
        "back": "far",
    }.items():
        text = text.replace(f"  {block}: {{", f"  {block}: {{at: {computer}, ")
    return text


def value(path: str, name: str, number: object) -> NewValue:
    return NewValue(path, name, number)


def tuned(steered: Steered, *values: NewValue) -> int:
    return steered.helm.tune(values).result(30)


NOBODY = Takers([], [], NoteTaker(*3 * [lambda *_: None]), lambda _: None, lambda *_: None)


def changes(log: Path) -> list[tuple[int, str, str, str]]:
    return [
        (int(each["tick"]), each["block"], each["parameter"], each["value"]) for each in read_log(log).changes
    ]


def test_a_run_waits_at_the_helm_is_tuned_stopped_and_repeated(tmp_path: Path) -> None:
    with Steered(load_text(TEXT), log=tmp_path / "run.mcap") as steered:
        helm = steered.helm
        early = helm.tune([value("law", "factor", 5.0), value("law", "factor", 6.0)])
        steered.reach("ready")
        wrong = helm.tune([value("ramp", "slope", 7.0), value("law", "facto", 1.0)])
        with pytest.raises(ParameterError, match=r"did you mean 'law\.factor'"):
            wrong.result(30)
        assert (helm.state, helm.tick, early.done()) == ("ready", 0, False)
        helm.begin()
        first = early.result(30)  # 0, if the loop was not late
        steered.reach("running")
        with pytest.raises(QuadvisError, match="the run has begun"):
            helm.stop_time = 3.0
        tick = tuned(steered, value("law", "factor", 8.0), value("back", "factor", 0.5))
        assert 0 < tick <= helm.tick + 1
        (task,) = [task for task in helm.times()[""] if task.task == "fast"]
        assert 0 < task.steps + task.overruns <= helm.tick + 1
        wait_for(lambda: helm.tick > tick + 8)
        helm.stop()
        result = steered.end()
    assert helm.state == "ended" and helm.tick >= tick + 8
    late = helm.tune([value("law", "factor", 9.0)])
    with pytest.raises(QuadvisError, match="the run has ended"):
        late.result(0)
    assert result.passed and result.flight is not None
    assert result.flight.early == f"it was stopped at t = {helm.time:.9g} s"
    assert result.duration == helm.time
    log = read_log(tmp_path / "run.mcap")
    assert log.complete and log.summary["stopped"] == result.flight.early and log.summary["passed"] == "true"
    assert changes(tmp_path / "run.mcap") == [
        (first, "law", "factor", "6.0"), (tick, "law", "factor", "8.0"), (tick, "back", "factor", "0.5"),
    ]  # fmt: skip
    ticks = np.rint(result.times("law.y") / 0.005)
    assert ticks[0] == first
    factor = np.where(ticks < tick, 6.0, 8.0)
    np.testing.assert_array_equal(result["law.y"], factor * result["noise.y"])
    assert result.times("ramp.y")[-1] == helm.time
    found = replay(log, engine="python")
    assert found.same and not found.whole and found.time == helm.time


@pytest.mark.slow
@pytest.mark.parametrize("text", [TEXT, MULTI], ids=["single", "multi"])
@pytest.mark.parametrize("engine", ["python", "native"])
def test_many_changes_are_all_taken_and_a_replay_has_the_same_bits(
    text: str, engine: str, tmp_path: Path
) -> None:
    with Steered(load_text(text), engine, tmp_path / "run.mcap") as steered:
        steered.helm.begin()
        steered.reach("running")
        futures: list[Future[int]] = []
        for number in range(100):
            factor = 1.0 + number / 100
            futures.append(
                steered.helm.tune([value("law", "factor", factor), value("back", "factor", -factor)])
            )
            time.sleep(0.005)
        ticks = [future.result(30) for future in futures]
        wait_for(lambda: steered.helm.tick > ticks[-1] + 8)
        steered.helm.stop()
        result = steered.end()
    assert ticks == sorted(ticks) and len(set(ticks)) > 10
    assert [each[0] for each in changes(tmp_path / "run.mcap")] == [tick for tick in ticks for _ in range(2)]
    held = np.searchsorted(ticks, np.rint(result.times("law.y") / 0.005), "right")
    factor = np.where(held == 0, 2.0, 1.0 + (held - 1) / 100)
    np.testing.assert_array_equal(result["law.y"], factor * result["noise.y"])
    assert replay(tmp_path / "run.mcap", engine=engine).same


@pytest.mark.slow
def test_several_computers_change_at_one_tick(tmp_path: Path) -> None:
    with Steered(load_text(on_two_computers()), log=tmp_path / "run.mcap") as steered:
        early = steered.helm.tune([value("law", "factor", 0.5), value("back", "factor", 0.5)])
        steered.helm.begin()
        early.result(30)
        steered.reach("running")
        tick = 0
        for number in (1.0, 2.0, 3.0):
            tick = tuned(steered, value("law", "factor", number), value("back", "factor", number))
        wait_for(lambda: steered.helm.tick > tick + 8)
        steered.helm.stop()
        result = steered.end()
    assert set(steered.helm.times()) == {"near", "far"}
    found = changes(tmp_path / "run.mcap")
    for number in ("0.5", "1.0", "2.0", "3.0"):
        near, far = (
            next(each[0] for each in found if each[1] == path and each[3] == number)
            for path in ("law", "back")
        )
        for signal_name, own in (("law.y", near), ("integral.y", far)):  # at every tick of their computers
            ticks = np.rint(result.times(signal_name) / 0.005)
            before = 0 if number == "0.5" else min(near, far)
            assert not ((ticks >= before) & (ticks < own)).any()
    assert result.flight is not None and result.flight.early
    assert replay(tmp_path / "run.mcap").same


def test_the_stop_time_is_set_at_the_helm(tmp_path: Path) -> None:
    with Steered(load_text(TEXT), log=tmp_path / "run.mcap") as steered:
        steered.helm.stop_time = "100 ms"
        steered.helm.begin()
        result = steered.end()
    assert result.flight is not None and result.flight.early == "its stop time was set to 100 ms"
    assert result.duration == 0.1 and result["ramp.y"][-1] <= 0.1
    assert result.passed and replay(tmp_path / "run.mcap").same


@pytest.mark.slow
def test_computers_wait_for_each_other_at_the_stop_time_that_was_set(tmp_path: Path) -> None:
    text = on_two_computers().replace("slow: 50 Hz", "slow: 5 Hz")
    with Steered(load_text(text), log=tmp_path / "run.mcap") as steered:
        steered.helm.stop_time = "310 ms"
        steered.helm.begin()
        result = steered.end()
    assert result.flight is not None and result.flight.early == "its stop time was set to 310 ms"
    assert [share.ticks for share in result.flight.shares] == [63, 63]
    (fast,) = [task for share in result.flight.shares for task in share.tasks if task.task == "fast"]
    assert fast.steps + fast.overruns == 63 and result.duration == 0.31
    assert result.passed and replay(tmp_path / "run.mcap").same


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "native"])
def test_a_computer_that_waits_for_others_at_the_stop_time_is_stopped(engine: str, tmp_path: Path) -> None:
    text = on_two_computers().replace("slow: 50 Hz", "slow: 0.01 Hz")
    text = text.replace("block: signal.integrator,", "block: signal.gain, rate: slow,")
    with Steered(load_text(text), engine, tmp_path / "run.mcap") as steered:
        steered.helm.begin()
        steered.reach("running")
        tuned(steered, value("law", "factor", 3.0))
        steered.until(lambda: all(task.steps + task.overruns for task in steered.helm.times()["far"]))
        near = steered.helm.times()["near"][0].steps
        steered.until(lambda: steered.helm.times()["near"][0].steps > near + 20)
        steered.helm.stop()
        result = steered.end()
    assert result.flight is not None
    assert result.flight.early == f"it was stopped at t = {result.times('law.y')[-1]:.9g} s"
    assert result.duration == result.times("law.y")[-1] > steered.helm.time == 0
    assert len(result["back.y"]) <= 1 and len(result["law.y"]) > 20
    assert replay(tmp_path / "run.mcap").same


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("text", [TEXT, MULTI], ids=["single", "multi"])
def test_a_run_without_end_is_stopped(text: str, engine: str) -> None:
    with Steered(load_text(text.replace("60 s", "50 ms")), engine) as steered:
        steered.helm.stop_time = math.inf
        steered.helm.begin()
        wait_for(lambda: steered.helm.tick > 30)
        steered.helm.stop()
        result = steered.end()
    assert result.flight is not None and "stopped at" in result.flight.early
    # Tasks in threads may not have begun the last tick for which they were released.
    assert result.times("integral.y")[-1] == steered.helm.time >= 0.15


def test_a_run_that_has_not_begun_is_stopped_and_can_lose_a_process(tmp_path: Path) -> None:
    with Steered(load_text(TEXT), log=tmp_path / "run.mcap") as steered:
        waiting = steered.helm.tune([value("law", "factor", 5.0)])
        steered.helm.stop()
        result = steered.end()
    assert result.flight is not None and result.flight.early == "it was stopped before its start"
    assert len(result["ramp.y"]) == 0
    with pytest.raises(QuadvisError, match="the run has ended"):
        waiting.result(0)


def test_a_run_that_fails_says_so_to_those_who_wait_and_a_helm_steers_one_run(tmp_path: Path) -> None:
    here: Any = SimpleNamespace(pid=os.getpid())
    before = set(children(here))
    with Steered(load_text(TEXT), log=tmp_path / "run.mcap") as steered:
        helm = steered.helm
        helm.begin()
        wait_for(lambda: helm.tick > 3)
        with pytest.raises(QuadvisError, match="has steered another run"):
            Paced(load_text(TEXT), "python", None, CALM, helm).run(NOBODY, ExitStack())
        assert helm.state == "running"
        (application,) = set(children(here)) - before
        os.kill(application, signal.SIGSTOP)
        waiting = helm.tune([value("law", "factor", 5.0)])
        os.kill(application, signal.SIGKILL)
        with pytest.raises(RunError, match="was killed by SIGKILL"):
            steered.end()
    with pytest.raises(QuadvisError, match="the run has ended"):
        waiting.result(0)
    assert helm.state == "ended" and helm.tick > 3 and changes(tmp_path / "run.mcap") == []


@pytest.mark.parametrize(
    ("given", "words"), [("5", "has no unit"), ("-1 s", "between 0 s and"), (1e10, "between 0 s and")]
)
def test_a_stop_time_that_cannot_be_is_refused(given: str | float, words: str) -> None:
    helm = Helm()
    with pytest.raises(DiagramError, match=words):
        helm.stop_time = given
    assert helm.stop_time is None
    helm.stop_time = "inf"
    assert helm.stop_time == ENDLESS
    helm.end()
