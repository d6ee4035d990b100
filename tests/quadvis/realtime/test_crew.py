"""Tasks in threads of their own, by a clock that stands still: their signals, and what each misses."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from quadvis.api import Diagram, load_text
from quadvis.engine.engine import Engine
from quadvis.errors import RunError
from quadvis.native.clock import GO
from quadvis.realtime import control, dispatch
from quadvis.realtime.streams import streams_of
from tests.quadvis.realtime.fakes import CrewClock, Paced
from tests.quadvis.realtime.test_streams import Kept
from tests.stages import mostly_slow

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")

MS = 1_000_000
TEXT = """\
quadvis: 1
name: crew
tasking: multi
rates: {fast: 1 kHz, mid: 250 Hz, slow: {rate: 100 Hz, offset: 2 ms}}
stop_time: 100 s
seed: 3
overload: {action: warn}
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 7 Hz, amplitude: 1 m}}
  lag:
    block: signal.low_pass
    rate: fast
    with: {time_constant: 5 ms}
    in: {u: {from: deep.y, across: newest}}
  ramp: {block: sources.ramp, rate: mid, with: {slope: 1 m/s}}
  mid:
    block: signal.low_pass
    rate: mid
    with: {time_constant: 9 ms}
    in: {u: {from: wave.y, across: sample}}
  back: {block: signal.gain, rate: mid, in: {u: {from: deep.y, across: newest}}}
  time: {block: sources.ramp, rate: slow, with: {slope: 2 m/s}}
  deep:
    block: signal.low_pass
    rate: slow
    with: {time_constant: 20 ms}
    in: {u: {from: mid.y, across: newest}}
  straight: {block: signal.gain, rate: slow, in: {u: {from: wave.y, across: sample}}}
"""
BLOCKS = ("wave", "lag", "ramp", "mid", "back", "time", "deep", "straight")
TASKS = {"fast": 0, "mid": 1, "slow": 2}
engines = pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))


def diagram(**replaced: str) -> Diagram:
    text = TEXT
    for old, new in replaced.items():
        text = text.replace(old, new)
    return load_text(text)


def busy(paced: Paced, clock: CrewClock, task: str, takes: dict[int, float]) -> list[int]:
    """Let the steps of a task at some ticks take so many ms; return a list that gets its ticks."""
    ticks: list[int] = []

    def work(tick: int) -> None:
        ticks.append(tick)
        time = round(takes.get(tick, 0) * MS)
        if time and TASKS[task]:
            clock.work(TASKS[task], time)
        elif time:
            clock.sleep(clock.instant + time)

    paced.engine.observe(task, work)
    return ticks


def simulated(made: Diagram, ticks: int) -> list[dict[int, bytes]]:
    engine, taps = Engine(made.graph, made.seed), [Kept(block) for block in BLOCKS]
    for tap in taps:
        engine.attach(tap)
    with engine:
        engine.run(ticks)
    return [tap.rows for tap in taps]


@engines
@pytest.mark.parametrize("length", [0.0, 0.7, 2.3])
def test_while_no_tick_is_lost_the_signals_are_those_of_the_simulation(engine: str, length: float) -> None:
    made, clock, taps = diagram(), CrewClock(), [Kept(block) for block in BLOCKS]
    pairs = streams_of(made.graph, taps)
    paced = Paced(made, clock, streams=[stream for stream, _ in pairs], engine=engine)
    if length:
        busy(paced, clock, "mid", {tick: length for tick in range(0, 200, 4)})
        busy(paced, clock, "slow", {tick: 3.9 * length for tick in range(2, 200, 10)})
    times = paced.run(201)
    for (stream, group), ring in zip(pairs, paced.shared.rings, strict=True):
        stream.hand_on(ring.take(last=True), group)
    assert [times[name].overruns for name in TASKS] == [0, 0, 0]
    assert [times[name].steps for name in TASKS] == [201, 51, 20]
    assert [tap.rows for tap in taps] == simulated(made, 201)


@engines
@pytest.mark.parametrize("task", ["fast", "mid", "slow"])
@pytest.mark.parametrize(("periods", "missed"), [(0.5, 0), (1.5, 1), (3.1, 3), (250.5, 250)])
def test_a_long_step_of_a_task_misses_ticks_of_this_task_alone(
    task: str, periods: float, missed: int, engine: str
) -> None:
    clock = CrewClock()
    paced = Paced(diagram(), clock, engine=engine)
    every, offset = {"fast": (1, 0), "mid": (4, 0), "slow": (10, 2)}[task]
    tick = 5 * every + offset
    ticks = {
        name: busy(paced, clock, name, {tick: periods * every} if name == task else {}) for name in TASKS
    }
    count = 20 * (5 + round(periods * every / 20) + every)
    times = paced.run(count)
    assert times[task].overruns == missed
    if task != "fast":
        assert [times[name].overruns for name in TASKS if name != task] == [0, 0]
    due = range(offset, count, every)
    assert ticks[task] == [each for each in due if each <= tick or each > tick + periods * every]
    assert all(len(ticks[name]) == times[name].steps for name in TASKS)
    assert [times[name].steps + times[name].overruns for name in TASKS] == [count, count // 4, count // 10]


@engines
def test_a_tick_of_a_slow_task_that_the_fastest_overran_begins_late(engine: str) -> None:
    clock = CrewClock()
    paced = Paced(diagram(), clock, engine=engine)
    fast = busy(paced, clock, "fast", {10: 3.1})  # 11, 12 and 13 are lost; 12 is one of both others
    mid, slow = busy(paced, clock, "mid", {}), busy(paced, clock, "slow", {})
    times = paced.run(30)
    assert [tick for tick in range(30) if tick not in fast] == [11, 12, 13]
    assert (mid, slow) == ([*range(0, 30, 4)], [2, 12, 22])
    assert times["slow"].lateness is not None and times["slow"].lateness.most == pytest.approx(2e-3)
    assert paced.engine.read("time", "y") == 0.044
    assert (times["mid"].overruns, times["slow"].overruns) == (0, 0)


def test_a_task_waits_for_outputs_of_a_faster_one_that_are_under_way() -> None:
    made, clock = diagram(), CrewClock()
    paced = Paced(made, clock)
    plan, shared, times, noted, *_, crew, memory = paced.pacer.words
    row = dispatch.HEAD + 2 * dispatch.ROW
    own = memoryview(np.array([0, 1], np.int64))

    def state() -> tuple[int, int]:
        return crew[row + dispatch.STATE], crew[row + dispatch.WAITS]

    assert dispatch.release(plan, shared, times, noted, crew, memory, 0) == GO
    assert state() == (dispatch.IDLE, 0)
    dispatch.hand_over(crew, memory, own[:1])
    assert dispatch.release(plan, shared, times, noted, crew, memory, 2) == GO
    assert state() == (dispatch.BUSY, 2)
    dispatch.hand_over(crew, memory, own[:1])
    assert state() == (dispatch.BUSY, 1)
    paced.engine.write("mid", "y", 7.0)
    assert paced.engine.read("deep", "u") == 0.0
    dispatch.hand_over(crew, memory, own[1:])
    assert state() == (dispatch.BUSY, 0)
    assert paced.engine.read("deep", "u") == 7.0
    paced.engine.write("mid", "y", 8.0)
    assert paced.engine.read("deep", "u") == 7.0


@engines
def test_times_of_a_task_do_not_depend_on_a_shift_while_it_runs(engine: str) -> None:
    clock = CrewClock()
    paced = Paced(diagram(), clock, engine=engine)
    shifts = {4: 300_000, 46: -200_000}  # 2 ms after the slow task's step of tick 2 has begun, and that of 42

    def shift(tick: int) -> None:
        paced.shared.control[control.SHIFT] = shifts.get(tick, paced.shared.control[control.SHIFT])

    paced.engine.observe("fast", shift)
    busy(paced, clock, "slow", {tick: 5.5 for tick in range(2, 100, 10)})
    times = paced.run(100)["slow"]
    assert (times.steps, times.overruns) == (10, 0)
    assert times.execution is not None and times.lateness is not None
    assert times.execution.least == times.execution.most == 5.5e-3
    assert times.lateness.least == times.lateness.most == 0.0


@engines
def test_overruns_of_a_task_stop_the_run_as_its_own_limits_say(engine: str) -> None:
    text = {"overload: {action: warn}": "overload: {max: 9, startup: 1, tasks: {slow: {max: 2}}}"}
    for periods, stops in ((2.5, False), (3.5, True)):
        made, clock = diagram(**text), CrewClock()
        paced = Paced(made, clock, made.overload, engine=engine)
        busy(paced, clock, "slow", {22: 10 * periods})
        if not stops:
            assert paced.run(100)["slow"].overruns == 2
            continue
        with pytest.raises(RunError, match=r"t = 0.052 s: .* 3 overruns: its step of t = 0.022 s is not"):
            paced.run(100)


@engines
def test_what_fails_in_a_thread_ends_the_run_with_its_block(engine: str) -> None:
    clock = CrewClock()
    paced = Paced(diagram(), clock, engine=engine)

    def spoil(tick: int) -> None:
        if tick == 22:
            paced.engine.write("deep", "time_constant", np.nan)

    paced.engine.observe("slow", spoil)
    with pytest.raises(RunError, match=r"block 'deep', port 'y', t = 0.032 s: the output became nan"):
        paced.run(100)
