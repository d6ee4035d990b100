"""Faults 5 and 6: blocks that give NaN or infinity, raise, or take too long."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.faults.bench import Bench, no_trace
from tests.processes import linux

pytestmark = [pytest.mark.faults, pytest.mark.slow, linux]

SPOILS = '''
"""Commands that pass unchanged until a time."""

import numpy as np

from quadvis.block import Block, In, Out, Param


class Spoils(Block, numeric=False):
    """Commands that pass unchanged until ``at``."""

    kind = Param("nan", choices=("nan", "inf", "raise", "shape"), doc="what comes then")
    at = Param(1.5, unit="s")
    u = In("float64[4]", unit="N")
    y = Out("float64[4]", unit="N")

    def output(self, u, time):
        if time < self.at:
            return u
        if self.kind == 2:
            raise ValueError("no such luck")
        if self.kind == 3:
            return u[:2]
        return np.where(np.arange(4) == 2, (np.nan, np.inf)[self.kind], u)
'''
BETWEEN = """
  spoils: {{block: own.spoils, rate: control, at: target, with: {{kind: {}}}, in: {{u: control.thrust}}}}
  gate:
    block: supervision.output_hold
    rate: control
    at: target
    in: {{u: spoils.y, stamp: control.stamp}}
"""
AT = r"1\.[5-9]\d*"  # ticks may have been lost
WORDS = {
    "nan": rf"block 'spoils', port 'y', t = {AT} s: .*nan",
    "raise": rf"block 'spoils', t = {AT} s: ValueError: no such luck in .*spoils\.py:\d+",
    "inf": rf"block 'spoils', port 'y', t = {AT} s: .*inf",
    "shape": rf"block 'spoils', port 'y', t = {AT} s: ",
}


@pytest.mark.parametrize("kind", ["nan", "raise"])
def test_05_a_block_that_fails_ends_the_flight_with_safe_frames_in_the_same_step(
    kind: str, tmp_path: Path
) -> None:
    with Bench(tmp_path, made={"blocks": BETWEEN.format(kind), "own": {"spoils": SPOILS}}) as bench:
        bench.flies()
        code, _, told = bench.ended()
        bench.left_safe()
    assert code == 1 and re.search(WORDS[kind], told), told
    no_trace(told)
    sent = bench.log["outputs.sent"]
    assert np.isfinite(sent).all() and (sent >= 0).all() and (sent <= 2).all()
    assert bench.log.times("outputs.sent")[-1] < 1.5


SLOW = '''
"""A task that takes too long: at its start, once, and then always."""

import time as clock

from quadvis.block import Block, Out, State


class Slow(Block, numeric=False):
    """Takes a period and a half in its first steps and once later, and in the end always two and a half."""

    y = Out()
    steps = State("int64")

    def open(self):
        self.begun = False

    def output(self):
        clock.sleep(0.15 if self.steps in (1, 2, 20) else 0.25 if self.steps >= 30 else 0.0)
        return 0.0

    def update(self):
        self.steps += 1
'''
MOST = 6  # ticks that the slow task may miss
LIMITS = f"{{max: 1000000, consecutive: 1000, tasks: {{sight: {{max: {MOST}, startup: 5}}}}}}"
TOO_OFTEN = rf"overload limit \({MOST}\) exceeded with \d+ overruns"
VITAL = "computers: {vision_pc: {on_loss: stop}}"  # or the others fly on without it, to the stop time


def test_06_a_task_that_is_too_slow_is_counted_by_itself_and_ends_the_flight_once_it_is_too_often(
    tmp_path: Path,
) -> None:
    slow = "  slow: {block: own.slow, rate: sight, at: vision_pc}"
    made = {"blocks": slow, "own": {"slow": SLOW}, "overload": LIMITS, "more": VITAL}
    with Bench(tmp_path, made=made) as bench:
        bench.flies()
        code, _, told = bench.ended()
        bench.left_safe()
    assert code == 1 and re.search(TOO_OFTEN, told), told
    no_trace(told)
    log = bench.log
    assert log.end is not None and log.end < 100  # the stop time is 140 s
    missed, at = log["_times/vision_pc/sight.overruns"], log.times("_times/vision_pc/sight.overruns")
    at_start = missed[at <= 1.5][-1]
    assert at_start >= 2  # and that ended nothing
    assert missed[-1] - at_start >= MOST - 1
    share = missed[-1] / len(missed)  # of its ticks; the others miss what the machine makes them miss
    for task in ("imu", "control"):
        overruns = log[f"_times/target/{task}.overruns"]
        assert overruns[-1] / len(overruns) < share, task
