"""Faults 8, 9, 10 and 19: processes of a flight that are killed, told to end, or held up."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from tests.faults.bench import PATIENCE, SAFE, Bench, no_trace
from tests.processes import linux, wait_for

pytestmark = [pytest.mark.faults, pytest.mark.slow, linux]

TICK = 0.01  # s, of the fastest loop
LATE = 2.0  # s; on a machine that others use, for what takes 0.1 s otherwise: see tools/bench_faults
KILLED = r"t = \S+ s: the application of .target. was killed by SIGKILL$"


@pytest.mark.parametrize(
    ("name", "code", "words"),
    [("target", 1, KILLED), ("command", -signal.SIGKILL, "")],
    ids=["target", "command"],
)
def test_08_kill_9_leaves_safe_frames_and_a_log_that_ends_with_the_flight(
    name: str, code: int, words: str, tmp_path: Path
) -> None:
    with Bench(tmp_path) as bench:
        bench.flies(2 * LATE)
        bench.send(signal.SIGKILL, name)
        at = bench.time
        found, _, told = bench.ended()
        bench.left_safe()
    assert found == code and re.search(words, told)
    no_trace(told)
    log = bench.log
    assert log.end is not None and log.end >= at - LATE
    assert log.complete == (name != "command")
    held = log.times("outputs.sent")
    assert np.allclose(np.diff(held) / 0.05, np.round(np.diff(held) / 0.05))


def interrupted_twice(bench: Bench) -> None:
    bench.send(signal.SIGINT)
    time.sleep(2 * TICK)
    bench.send(signal.SIGINT)


ENDS: dict[str, tuple[Callable[[Bench], None], int]] = {
    "SIGTERM": (lambda bench: bench.send(signal.SIGTERM), 143),
    "SIGHUP": (lambda bench: bench.send(signal.SIGHUP), 129),
    "Ctrl-C": (lambda bench: bench.send(signal.SIGINT), 130),
    "Ctrl-C twice": (interrupted_twice, 130),
}


@pytest.mark.parametrize("name", ENDS)
def test_09_who_tells_it_to_end_is_obeyed_with_safe_frames_and_the_right_code(
    name: str, tmp_path: Path
) -> None:
    end, code = ENDS[name]
    with Bench(tmp_path) as bench:
        bench.flies()
        end(bench)
        found, _, told = bench.ended()  # and no process is left
        bench.left_safe()
    assert found == code, told
    no_trace(told)
    assert bench.log.complete


def pause(bench: Bench, seconds: float) -> float:
    """Hold up the computer that controls; return the time at which that began (s)."""
    target, began = bench.member("target"), bench.time
    bench.send(signal.SIGSTOP, "target")
    wait_for(lambda: bench.time >= began + seconds or bench.has_ended)
    if not bench.has_ended:
        bench.send(signal.SIGCONT, "target")
    assert target
    return began


def test_10_a_loop_that_was_held_up_is_safe_meanwhile_and_leaves_out_what_it_missed(tmp_path: Path) -> None:
    with Bench(tmp_path, made={"overload": "{action: warn}"}) as bench:
        bench.flies(2.0)
        before = len(bench.frames)
        began = pause(bench, 0.5)
        bench.flies(began + 1.5)
        wait_for(lambda: bench.has_ended or bench.frames[-1] != SAFE, PATIENCE)  # it flies again
        runs = [(safe, len([*run])) for safe, run in groupby(bench.frames[before:], SAFE.__eq__)]
        bench.send(signal.SIGTERM)
        bench.ended()
    assert max(count for safe, count in runs if safe) >= 20 and not runs[-1][0]
    ticks = bench.log.times("imu_line.gyro")
    assert np.diff(ticks).max() >= 0.4
    # Ticks that ran and ticks that are counted as missed are all that there were: none was made up for.
    overruns = bench.log["_times/target/imu.overruns"]
    counted = len(ticks) + overruns[-1] - 1
    assert abs(counted - ticks[-1] / TICK) <= 1 and (np.diff(ticks) > TICK / 2).all()


def test_10_where_overruns_count_a_loop_that_was_held_up_ends_the_flight_safely(tmp_path: Path) -> None:
    limits = "{max: 1000000, consecutive: 20, startup: 50}"
    with Bench(tmp_path, made={"overload": limits}) as bench:
        bench.flies(1.0)
        bench.send(signal.SIGSTOP, "target")
        code, _, told = bench.ended()
        bench.left_safe()
    assert code == 1 and "the loop of 'target' has given no sign of life for 0.22 s" in told
    no_trace(told)


def test_19_without_its_guardian_a_flight_ends_and_somebody_else_sends_the_safe_frame(tmp_path: Path) -> None:
    with Bench(tmp_path) as bench:
        bench.flies(1.0)
        bench.send(signal.SIGKILL, "guardian")
        at = bench.time
        code, _, told = bench.ended()
    assert code == 1 and told.endswith("the guardian of the outputs has been lost\n")
    assert bytes(bench.rc.sent).endswith(SAFE)
    assert bench.log.end is not None and bench.log.end <= at + LATE
    no_trace(told)
