"""Fault 16: the host of a target is killed in a flight, and another one comes later."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.host.target import Target
from quadvis.output.log_reader import Log
from tests.faults.bench import PATIENCE, SAFE, BenchLines, no_trace
from tests.processes import linux, wait_for
from tests.quadvis.host.targets import running_target

pytestmark = [pytest.mark.faults, pytest.mark.slow, linux]

PERIOD = 0.05  # s of the commands
LATE = 1.0  # s of commands that a busy machine may have missed last
SIGNAL = "gate.y"
# A host as people write them: it flies the bench, and prints the times of the commands that it sees.
HOST = f"""
import json
import sys
from quadvis import Target

with Target("lab") as tg, tg.operator():
    tg.load(sys.argv[1])
    tg.start()
    scope = tg.addscope("host", signals=["{SIGNAL}"], NumSamples=10, TriggerMode="FreeRun").start()
    for package in scope.packages(timeout=60):
        print(json.dumps([package.times.tolist(), package.samples.tolist()]), flush=True)
"""


class Watched:
    """What hosts have seen: the times (s) and the values of commands."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.values: list[Any] = []

    def take(self, line: str) -> None:
        """Take a line of a host."""
        times, values = json.loads(line)
        self.times += times
        self.values += values

    def agrees(self, log: Log) -> bool:
        """Return whether the log has all of it."""
        times, values = log.times(SIGNAL), log[SIGNAL]
        at = np.minimum(np.searchsorted(times, np.array(self.times) - PERIOD / 2), len(times) - 1)
        return np.allclose(times[at], self.times) and np.array_equal(values[at], np.array(self.values))


@contextmanager
def host(
    bench: BenchLines, environment: Mapping[str, str]
) -> Iterator[tuple[subprocess.Popen[str], Watched]]:
    """Start a host that flies the bench, and yield it once it has seen commands."""
    command = [sys.executable, "-c", HOST, str(bench.diagram)]
    process = subprocess.Popen(command, env=dict(environment), stdout=subprocess.PIPE, text=True)
    watched = Watched()
    assert process.stdout is not None
    try:
        while len(watched.times) < 30:
            line = process.stdout.readline()
            assert line, "the host has ended by itself"
            watched.take(line)
        yield process, watched
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.parametrize("policy", ["continue", "safe", "stop"])
def test_16_a_target_does_without_its_host_what_it_should_and_its_log_fills_the_gap(
    policy: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = BenchLines(tmp_path, more=f"on_host_loss: {policy}\nstop_time: 600 s")
    with bench, running_target() as lab:  # whose ports are closed before the lines are
        for name in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
            monkeypatch.setenv(name, lab.environment[name])
        with host(bench, lab.environment) as (process, seen):
            lost = bench.time
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            assert process.stdout is not None
            for line in process.stdout:  # what it had still printed
                seen.take(line)
        if policy == "continue":
            wait_for(lambda: bench.time > lost + 2.0, PATIENCE)
        else:
            wait_for(lambda: bench.frames[-1] == SAFE, PATIENCE)
        with Target("lab") as tg:
            if policy == "continue":
                assert tg.Status == "running"
                again = Watched()
                scope = tg.addscope("host", signals=[SIGNAL], NumSamples=10).start()
                package = next(scope.packages(timeout=PATIENCE))
                again.times, again.values = package.times.tolist(), package.samples.tolist()
                tg.stop()
            else:
                wait_for(lambda: tg.Status == "stopped")
            log = tg.getlog()
            assert isinstance(log, Log)
        bench.left_safe()
        no_trace(lab.output)
    assert seen.agrees(log)
    times = log.times(SIGNAL)
    if policy != "continue":
        assert lost - LATE < times[-1]
        return
    assert again.agrees(log) and again.times[0] > seen.times[-1] + PERIOD  # a gap there was
    gap = (times > seen.times[-1] + PERIOD / 2) & (times < again.times[0] - PERIOD / 2)
    missed = log["_times/target/control.overruns"][-1]
    wanted = round((again.times[0] - seen.times[-1]) / PERIOD) - 1
    assert wanted - missed <= gap.sum() <= wanted
