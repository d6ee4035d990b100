"""Real-time runs repeated from their logs: with what came from outside, and without the ticks left out."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis import Log, read_log, replay
from quadvis.api import load_text
from quadvis.cli import main
from quadvis.engine.tuning import NewValue
from quadvis.errors import QuadvisError
from quadvis.output.log import LogWriter
from tests.processes import children, gone, wait_for
from tests.quadvis.realtime.fakes import FakeClock, Paced
from tests.quadvis.realtime.steered import CALM, Steered
from tests.quadvis.relogged import rewritten, without

FAR = {"integral": "far", "delayed": "far"}
TEXT = """\
quadvis: 1
name: flight
rates: {fast: 100 Hz, slow: {rate: 20 Hz, offset: 10 ms}}
solver: {method: ode4, step: 5 ms}
stop_time: 0.6 s
seed: 7
overload: {action: warn}
blocks:
  counter: {block: own.counter, rate: fast}
  noise: {block: sources.noise, rate: fast, with: {sigma: 0.1 m}}
  sum: {block: signal.sum, rate: fast, in: {u: [noise.y, counter.y]}}
  integral: {block: signal.integrator, in: {u: {from: sum.y, across: hold}}}
  delayed: {block: signal.gain, rate: slow, in: {u: {from: integral.y, across: delay}}}
log: {every: {fast: 4}}
"""
BACK = """\
  back: {block: signal.gain, rate: fast, in: {u: {from: delayed.y, across: newest}}}
  sum: {block: signal.sum, rate: fast, in: {u: [back.y,"""
COUNTER = '''
"""A block that reads a clock, which never says the same twice, and sometimes too slowly."""

import time as clock

from quadvis.block import Block, Out


class Counter(Block, numeric=False):
    """Reads the time of the day."""

    y = Out(unit="m")

    def open(self):
        self.count = 0

    def read(self):
        self.count += 1
        self.now = clock.time_ns()
        if self.count in (7, 8, 21):
            clock.sleep(0.047)

    def output(self):
        return self.now % 1000 / 1000
'''


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("flight.yaml").write_text(TEXT)
    Path("blocks/own").mkdir(parents=True)
    Path("blocks/own/counter.py").write_text(COUNTER)


def left_out(log: Log) -> list[int]:
    """Return the ticks that a run has left out."""
    ticks = log.hidden.arrays("/_replay/left_out")[1].tolist() if log.hidden.names else []
    return [tick for first, count in ticks for tick in range(first, first + count)]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
def test_a_run_with_overruns_is_the_same_to_the_bit() -> None:
    result = quadvis.load("flight.yaml").run(log="run.mcap", real_time=CALM)
    log = read_log("run.mcap")
    assert result.flight is not None
    missed = result.flight.shares[0].tasks[0].overruns  # of the continuous task, which is due at each tick
    assert missed >= 3 * 8 and len(left_out(log)) == missed
    assert len(set(log.hidden["_replay/inputs/counter.y"].tolist())) > 20
    found = replay(log, output="new.mcap")
    assert found.same and found.whole
    assert (found.ticks, found.left_out, found.played) == (121 - missed, missed, ("counter",))
    new = read_log("new.mcap")
    assert left_out(new) == left_out(log)
    assert replay(new).same
    longest = int(
        log.hidden.arrays("/_replay/left_out")[1][:, 1].argmax()
    )  # others may lie between two ticks
    with pytest.raises(QuadvisError, match="lacks the outputs of 'counter' at t = "):
        replay(rewritten(log, without("/_replay/left_out", longest)))


@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
def test_a_run_that_is_interrupted_while_rows_are_handed_on_has_them_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What has been taken from the loop is in the log, or a replay would lack it in the middle."""
    write, came = LogWriter.write_rows, []

    def interrupted(self: LogWriter, block: int, times: Any, rows: Any) -> None:
        if not came and times[-1] > 0.2e9:
            came.append(block)
            time.sleep(0.1)  # more rows come meanwhile
            os.kill(os.getpid(), signal.SIGINT)
        write(self, block, times, rows)

    monkeypatch.setattr(LogWriter, "write_rows", interrupted)
    with pytest.raises(KeyboardInterrupt):
        quadvis.load("flight.yaml").run(log="run.mcap", real_time=CALM)
    found = replay("run.mcap")
    assert came and found.same and not found.whole and found.ticks > 20


DRAG = '''
"""A block that is sometimes too slow for its task."""

import time as clock

from quadvis.block import Block, In, Out, Param, State


class Drag(Block, numeric=False):
    """Adds up its input, and amplifies it."""

    u = In(unit="m")
    y = Out(unit="m")
    factor = Param(1.0, tune=True)
    count = State()
    sum = State()

    def output(self, u):
        factor = self.factor
        if self.count in (2, 5, 6):
            clock.sleep(0.09)
        assert self.factor == factor
        return self.sum + factor * u

    def update(self, u):
        self.count += 1.0
        self.sum += u
'''


def write_dragged() -> None:
    """Write a diagram whose tasks run by themselves and miss ticks."""
    Path("blocks/own/drag.py").write_text(DRAG)
    text = TEXT.replace("seed: 7", "seed: 7\ntasking: multi").replace("across: hold", "across: newest")
    text = text.replace("  delayed: {block: signal.gain,", "  delayed: {block: own.drag,")
    text = text.replace("  sum: {block: signal.sum, rate: fast, in: {u: [noise.y,", BACK)
    text = text.replace("from: integral.y, across: delay", "from: sum.y, across: newest")
    Path("flight.yaml").write_text(text)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
def test_tasks_that_run_by_themselves_are_the_same_to_the_bit_with_what_each_missed() -> None:
    write_dragged()
    result = quadvis.load("flight.yaml").run(log="run.mcap", real_time=CALM)
    assert result.flight is not None
    tasks = {each.task: each for each in result.flight.shares[0].tasks}
    assert tasks["slow"].overruns >= 2 and tasks["fast"].overruns >= 3 * 4
    log = read_log("run.mcap")
    missed = log.hidden.arrays("/_replay/releases")[1]
    assert missed[:, 2].sum() == sum(each.overruns for each in result.flight.shares[0].tasks[1:])
    assert len(log["delayed.y"]) == tasks["slow"].steps
    for name, task in tasks.items():
        assert len(log[f"_times/{name}.lateness"]) == task.steps
    found = replay(log, output="new.mcap")
    assert found.same and found.whole
    assert replay("new.mcap").same


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
def test_tasks_that_are_tuned_and_miss_ticks_are_the_same_to_the_bit_when_the_run_is_stopped() -> None:
    write_dragged()
    with Steered(quadvis.load("flight.yaml"), log=Path("run.mcap")) as steered:
        steered.helm.stop_time = "60 s"
        steered.helm.begin()
        steered.reach("running")
        ticks = []
        for number in range(40):
            group = {"delayed": 1.0 + number, "back": 0.5 / (1 + number)}
            values = [NewValue(path, "factor", value) for path, value in group.items()]
            ticks.append(steered.helm.tune(values).result(30))
        wait_for(lambda: steered.helm.tick > ticks[-1] + 20)
        steered.helm.stop()
        result = steered.end()
    assert result.flight is not None and "stopped at" in result.flight.early
    tasks = {each.task: each for each in result.flight.shares[0].tasks}
    assert tasks["slow"].overruns >= 2 and tasks["fast"].overruns >= 3 * 4
    log = read_log("run.mcap")
    assert [int(each["tick"]) for each in log.changes] == [tick for tick in ticks for _ in range(2)]
    assert ticks == sorted(set(ticks))
    found = replay(log, output="new.mcap")
    assert found.same and not found.whole
    assert replay("new.mcap").same and read_log("new.mcap").changes == log.changes


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
@pytest.mark.parametrize("via", ["memory", "serial, baud: 230400"])
def test_two_computers_are_the_same_to_the_bit(via: str) -> None:
    """What a link brings depends on the moment; a replay has it from the log."""
    link = f"links: {{line: {{from: near, to: far, via: {via}}}}}"
    text = TEXT.replace("seed: 7", f"seed: 7\ncomputers: {{near: {{}}, far: {{}}}}\n{link}")
    for block, computer in {"counter": "near", "noise": "near", "sum": "near"}.items() | FAR.items():
        text = text.replace(f"  {block}: {{", f"  {block}: {{at: {computer}, ")
    Path("flight.yaml").write_text(text.replace(", across: hold", ""))
    result = quadvis.load("flight.yaml").run(log="run.mcap", real_time=CALM)
    assert result.flight is not None
    missed = {share.computer: share.tasks[0].overruns for share in result.flight.shares}
    assert missed["near"] >= 3 * 4
    found = replay("run.mcap")
    assert found.same and set(found.played) == {"counter", "line"}
    assert found.left_out >= sum(missed.values())


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
def test_the_log_of_a_run_that_was_killed_is_the_same_as_far_as_it_goes(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = [sys.executable, "-m", "quadvis", "run", "flight.yaml", "--real-time", "--priority", "0"]
    process = subprocess.Popen([*command, "--poll", "0", "--stop-time", "1000 s", "--log", "run.mcap"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    path = Path("run.mcap")

    def grown() -> bool:
        log = read_log(path) if path.exists() and path.stat().st_size else None
        return log is not None and "integral.y" in log.names and len(log["integral.y"]) > 60

    wait_for(grown)
    application = children(process)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    assert all(wait_for(lambda pid=pid: gone(pid)) for pid in application)
    assert not read_log(path).complete
    assert main(["replay", "run.mcap"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "is cut short" in lines[1]
    assert lines[-1].endswith("as far as the log goes: the same to the bit")
    assert len(left_out(read_log(path))) >= 3 * 8


def test_the_loop_notes_each_run_of_ticks_that_it_leaves_out() -> None:
    clock = FakeClock({5: 10**7, 9: 35 * 10**6})
    text = TEXT.replace("own.counter", "sources.sine").replace("noise.y, counter.y", "noise.y, 0 m")
    paced = Paced(load_text(text), clock)
    ran: list[int] = []
    paced.engine.observe("continuous", ran.append)
    paced.run(60)
    found = np.array(paced.shared.notes.left_out.take(last=True))
    missed = [tick for first, count in found.tolist() for tick in range(first, first + count)]
    assert len(found) == 2 and sorted(missed + ran) == list(range(60))
