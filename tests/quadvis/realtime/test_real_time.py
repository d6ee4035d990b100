"""Real-time runs as a whole, in a process of their own: their results, and their ends."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.cli import main
from quadvis.errors import QuadvisError, RunError
from quadvis.output.log_reader import read_log
from quadvis.realtime import supervisor
from tests.processes import children, gone, wait_for
from tests.stages import mostly_slow

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")

CALM = quadvis.RealTime(priority=0, poll="0 s")
TEXT = """\
quadvis: 1
name: flight
rates: {fast: 50 Hz, slow: 10 Hz}
stop_time: 0.4 s
seed: 7
overload: {max: 1000000}
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 1 Hz, amplitude: 2 m}}
  slow: {block: signal.gain, rate: slow, with: {factor: 2}, in: {u: {from: wave.y, across: sample}}}
  end: {block: own.ending, rate: fast}
expect:
  - {signal: wave.y, within: 2 m}
summary:
  wave: {signal: wave.y, show: [max]}
"""
OWN = '''
"""A block that leaves a trace of its life, and does what a test wants from 0.1 s on."""

import os
import signal
import time as clock
from pathlib import Path

from quadvis.block import Block, Out


class Ending(Block, numeric=False):
    """Writes what was called into the file 'life'."""

    y = Out()

    def note(self, word):
        with open("life", "a") as file:
            print(word, file=file)

    def open(self):
        self.note("open")

    def output(self, time):
        if time >= 0.1:
            self.at()
        return time

    def at(self):
        ...

    def write_safe(self, time):
        self.note("safe")

    def close(self):
        self.note("close")
'''


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    before = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT), sys.unraisablehook
    monkeypatch.chdir(tmp_path)
    write()
    yield tmp_path
    signal.signal(signal.SIGTERM, before[0])
    signal.signal(signal.SIGINT, before[1])
    sys.unraisablehook = before[2]


def write(at: str = "...", **replaced: str) -> None:
    """Write the diagram, and the block with what it does from 0.1 s on."""
    text = TEXT
    for old, new in replaced.items():
        text = text.replace(f"{old}: {text.partition(f'{old}: ')[2].partition(chr(10))[0]}", f"{old}: {new}")
    Path("flight.yaml").write_text(text)
    Path("blocks").mkdir(exist_ok=True)
    Path("blocks/own").mkdir(exist_ok=True)
    Path("blocks/own/ending.py").write_text(OWN.replace("        ...\n", f"        {at}\n"))


def life() -> list[str]:
    return Path("life").read_text().split()


def started(*more: str) -> subprocess.Popen[str]:
    """Start a long real-time run; return its process once its log grows."""
    command = [sys.executable, "-m", "quadvis", "run", "flight.yaml", "--real-time", "--priority", "0"]
    process = subprocess.Popen(
        [*command, "--poll", "0", "--log", "run.mcap", *more],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    log = Path("run.mcap")
    wait_for(
        lambda: process.poll() is not None or (log.exists() and log.stat().st_size and rows_in_log() > 3)
    )
    assert process.poll() is None, process.communicate()
    return process


def rows_in_log() -> int:
    log = read_log("run.mcap")
    return len(log["wave.y"]) if "wave.y" in log.names else 0


def test_a_real_time_run_gives_the_signals_of_a_simulation() -> None:
    diagram = quadvis.load("flight.yaml")
    simulated, said = diagram.run(), []
    wall = time.monotonic()
    result = diagram.run(log="run.mcap", real_time=CALM, announce=said.append)
    assert time.monotonic() - wall >= 0.4
    assert said[0].startswith("real time: ")
    assert result.passed
    assert life() == ["open", "safe", "close"] * 2
    assert result.flight is not None
    fast, slow = result.flight.shares[0].tasks
    assert (fast.steps + fast.overruns, slow.steps + slow.overruns) == (21, 5)
    assert len(result["wave.y"]) == fast.steps
    for name in ("wave.y", "slow.y", "end.y"):  # a stamp tells the tick; the loaded machine may miss some
        there = np.isin(simulated.signals.stamps(name), result.signals.stamps(name))
        np.testing.assert_array_equal(simulated[name][there], result[name])
    log = read_log("run.mcap")
    assert log.complete
    assert log.metadata["clock"] == "real time"
    assert json.loads(log.summary["real time"])["computers"][0]["tasks"]["fast"]["steps"] == fast.steps


@pytest.mark.slow
def test_the_command_prints_times_and_what_was_granted(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "flight.yaml", "--real-time", "--priority", "0", "--log", "", "--json"]) == 0
    out, err = capsys.readouterr()
    facts = json.loads(out)["real_time"]
    (computer,) = facts["computers"]
    assert computer["computer"] is None
    assert {"gc off", "timers exact"} <= set(computer["granted"])
    assert set(computer["tasks"]) == {"fast", "slow"}
    assert computer["tasks"]["fast"]["execution"]["max_s"] > 0
    assert facts["lost_rows"] == 0
    assert "real time: " in err


@pytest.mark.slow
def test_an_exception_in_a_block_is_the_error_of_the_run() -> None:
    write("raise ValueError('no such luck')")
    with pytest.raises(RunError, match=r"block 'end', t = \S+ s: ValueError: no such luck"):
        quadvis.load("flight.yaml").run(log="run.mcap", real_time=CALM)
    assert life() == ["open", "safe", "close"]
    assert "no such luck" in read_log("run.mcap").summary["stopped"]
    assert rows_in_log() >= 1


@pytest.mark.slow
def test_what_is_gone_at_the_stop_time_fails_a_run_that_is_judged(capsys: pytest.CaptureFixture[str]) -> None:
    block = Path("blocks/own/ending.py")
    block.write_text(block.read_text() + "        raise OSError('the camera is gone')\n")
    assert main(["run", "flight.yaml", "--real-time", "--priority", "0", "--log", "run.mcap"]) == 1
    out, err = capsys.readouterr()
    assert re.search(r"^  met  wave.y within 2 m", out, re.M), out
    assert "FAILED: 1 of 1 expectations met" in out
    assert re.search(r"^block 'end', t = \S+ s: cannot close: .*the camera is gone", err, re.M), err
    log = read_log("run.mcap")
    assert log.complete and log.summary["expect 1"].startswith("met: wave.y within 2 m")
    (computer,) = json.loads(log.summary["real time"])["computers"]
    assert "the camera is gone" in computer["problem"]


@pytest.mark.slow
def test_a_device_that_cannot_be_opened_ends_the_run_before_it_begins() -> None:
    block = Path("blocks/own/ending.py")
    block.write_text(block.read_text().replace('self.note("open")', 'raise OSError("no device")'))
    with pytest.raises(RunError, match=r"block 'end', t = 0 s: cannot open: .*no device"):
        quadvis.load("flight.yaml").run(real_time=CALM)
    assert life() == ["close"]


@pytest.mark.slow
def test_an_overload_stops_the_run() -> None:
    write("clock.sleep(0.07)", overload="{max: 2, startup: 2}")
    with pytest.raises(RunError, match=r"task 'fast': overload limit \(2\) exceeded with \d+ overruns: the "):
        quadvis.load("flight.yaml", stop_time="10 s").run(log="run.mcap", real_time=CALM)
    assert life() == ["open", "safe", "close"]
    assert not read_log("run.mcap").summary.get("passed")


@pytest.mark.slow
def test_overruns_are_announced_once_a_second_and_add_up() -> None:
    write("clock.sleep(0.03)", overload="{action: warn}")
    said: list[str] = []
    result = quadvis.load("flight.yaml", stop_time="2.5 s").run(real_time=CALM, announce=said.append)
    assert result.flight is not None
    warnings = said[1:]
    assert 2 <= len(warnings) <= 4
    told = [int(count) for line in warnings for count in re.findall(r"'fast' has (\d+) more overrun", line)]
    assert sum(told) == result.flight.shares[0].tasks[0].overruns >= 50
    assert result.passed  # what the diagram allows is no lack


@pytest.mark.slow
@pytest.mark.parametrize(
    ("at", "words", "traces"),
    [
        ("clock.sleep(100)", "block 'end', t = T s: the step has not ended after 0.5 s", ["safe", "close"]),
        (
            "signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM]); clock.sleep(100)",
            "t = T s: the step has not ended after 0.5 s",
            [],
        ),
        ("os.kill(os.getpid(), signal.SIGKILL)", "t = T s: the application was killed by SIGKILL", []),
        ("os._exit(3)", "t = T s: the application has ended with exit code 3", []),
        (
            "os.kill(os.getpid(), signal.SIGTERM)",
            "t = T s: the application was told to end",
            ["safe", "close"],
        ),
    ],
)
def test_hangs_and_deaths_of_the_application(
    at: str, words: str, traces: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervisor, "HANG", 0.5)
    monkeypatch.setattr(supervisor, "GRACE", 0.5)
    write(at, overload="{startup: 1000000}")
    with pytest.raises(RunError) as caught:
        quadvis.load("flight.yaml", stop_time="50 s").run(log="run.mcap", real_time=CALM)
    assert re.sub(r"\bt = \S+ s", "t = T s", str(caught.value)) == words
    assert getattr(caught.value, "__notes__", []) == ([] if traces else [supervisor.UNSAFE])
    assert life() == ["open", *traces]
    assert rows_in_log() >= 1


@pytest.mark.parametrize(
    ("number", "code", "words"),
    mostly_slow([(signal.SIGINT, 130, "interrupted\n"), (signal.SIGTERM, 143, ""), (signal.SIGHUP, 129, "")]),
)
def test_what_ends_the_command_ends_the_application_orderly(
    number: signal.Signals, code: int, words: str
) -> None:
    process = started("--stop-time", "1000 s")
    application = children(process)
    os.killpg(process.pid, number)
    _, told = process.communicate(timeout=60)
    assert process.returncode == code
    assert told.endswith(f"log up to there: run.mcap\n{words}" if words else told)
    assert all(wait_for(lambda pid=pid: gone(pid)) for pid in application)
    assert life() == ["open", "safe", "close"]
    assert read_log("run.mcap").complete


@pytest.mark.slow
def test_if_the_command_is_killed_the_application_ends_orderly() -> None:
    process = started("--stop-time", "1000 s")
    application = children(process)
    assert len(application) == 1
    count = rows_in_log()
    process.kill()
    process.communicate(timeout=60)
    assert all(wait_for(lambda pid=pid: gone(pid)) for pid in application)
    assert life() == ["open", "safe", "close"]
    assert rows_in_log() >= count


@pytest.mark.slow
def test_if_the_application_is_killed_the_command_says_so() -> None:
    process = started("--stop-time", "1000 s")
    os.kill(children(process)[0], signal.SIGKILL)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "the application was killed by SIGKILL\n" + supervisor.UNSAFE in told
    log = read_log("run.mcap")
    assert log.complete
    stamps = log.stamps("wave.y")
    assert len(stamps) > 3


@pytest.mark.slow
def test_a_supervisor_that_is_stopped_does_not_stop_the_loop() -> None:
    """Its rings overflow, which is counted; their rows are no part of the log, and all others are."""
    process = started("--stop-time", "8 s", "--json")
    os.kill(process.pid, signal.SIGSTOP)
    time.sleep(4)
    os.kill(process.pid, signal.SIGCONT)
    out, told = process.communicate(timeout=60)
    facts = json.loads(out)
    lost = facts["real_time"]["lost_rows"]
    assert process.returncode == 1
    assert lost > 0
    assert told.endswith(f"{lost} rows found no room on the way to the log and the verdicts\n")
    assert not facts["passed"]
    tasks = facts["real_time"]["computers"][0]["tasks"]
    assert tasks["fast"]["steps"] + tasks["fast"]["overruns"] == 401
    log = read_log("run.mcap")
    rows = sum(len(log[name]) for name in ("wave.y", "slow.y", "end.y"))
    assert rows + lost == 2 * tasks["fast"]["steps"] + tasks["slow"]["steps"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--cpu", "1"], "--cpu is for a real-time run; add --real-time"),
        (["--real-time", "--poll", "19 ms"], "--poll 19 ms is more than 90 % of the period of 20 ms: "),
        (["--real-time", "--priority", "100"], "--priority must be from 1 to 99, or 0 for none, not 100"),
        (["--real-time", "--poll", "soon"], "--poll: 'soon' does not begin with a number; "),
    ],
)
def test_options_that_are_refused(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("run.mcap").write_text("the log of an earlier run")
    assert main(["run", "flight.yaml", "--log", "run.mcap", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert not Path("life").exists()
    assert Path("run.mcap").read_text() == "the log of an earlier run"


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_tasks_that_run_by_themselves_give_the_signals_of_a_simulation(engine: str) -> None:
    write(seed="7\ntasking: multi")
    diagram = quadvis.load("flight.yaml")
    simulated = diagram.run(engine=engine)
    said: list[str] = []
    result = diagram.run(engine=engine, real_time=CALM, announce=said.append)
    assert result.passed
    assert life() == ["open", "safe", "close"] * 2
    assert result.flight is not None
    fast, slow = result.flight.shares[0].tasks
    assert (fast.steps + fast.overruns, slow.steps + slow.overruns) == (21, 5)
    assert fast.steps and slow.steps
    for name in ("wave.y", "end.y"):
        ran = np.isin(simulated.times(name), result.times(name))
        np.testing.assert_array_equal(result[name], simulated[name][ran])
    if (
        not fast.overruns
    ):  # where the fast task has left a tick out, the slow one begins late with older values
        ran = np.isin(simulated.times("slow.y"), result.times("slow.y"))
        np.testing.assert_array_equal(result["slow.y"], simulated["slow.y"][ran])
    assert any("task 'fast' runs Python" in words for words in said)


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_a_block_that_fails_in_a_thread_of_its_own_ends_the_run(engine: str) -> None:
    write("raise OSError('no such device')", seed="7\ntasking: multi")
    text = (
        Path("flight.yaml")
        .read_text()
        .replace("end: {block: own.ending, rate: fast}", "end: {block: own.ending, rate: slow}")
    )
    Path("flight.yaml").write_text(text)
    with pytest.raises(RunError, match="OSError: no such device") as caught:
        quadvis.load("flight.yaml").run(engine=engine, real_time=CALM)
    assert (caught.value.block, caught.value.time) == ("end", 0.1)
    assert life() == ["open", "safe", "close"]


@pytest.mark.slow
def test_outputs_that_overruns_made_safe_fail_the_run_and_let_it_go_on(
    capsys: pytest.CaptureFixture[str],
) -> None:
    once = "Path('once').exists() or (Path('once').touch(), clock.sleep(0.07))"
    write(once, overload="{startup: 0, action: safe}")
    command = ["run", "flight.yaml", "--real-time", "--priority", "0", "--log", "run.mcap"]
    assert main(command) == 1
    told = capsys.readouterr().err
    assert "overload limit (0) exceeded with" in told
    assert "the outputs have held their safe values from then on\n" in told
    assert life() == ["open", "safe", "safe", "close"]
    assert read_log("run.mcap").stamps("wave.y")[-1] > 200_000_000


def test_real_time_is_linuxs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(QuadvisError, match="a real-time run needs Linux"):
        CALM.check(quadvis.load("flight.yaml").graph)
