"""The pacer by a clock that stands still: which ticks run, what is missed, and what is counted."""

from __future__ import annotations

import os
import signal
import threading
import time
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.api import Diagram, load_text
from quadvis.diagram.sections.overload import OverloadLimits, TaskLimits
from quadvis.errors import Place, RunError
from quadvis.realtime import control
from quadvis.realtime.clocks import MonotonicClock
from quadvis.realtime.overload import SIGNAL
from quadvis.realtime.pacer import Ended
from tests.quadvis.realtime.fakes import WARN, FakeClock, Paced
from tests.stages import mostly_slow

MS = 1_000_000
FAST = """\
quadvis: 1
name: paced
rates: {fast: 1 kHz}
stop_time: 100 s
blocks:
  ramp: {block: sources.ramp, rate: fast, with: {slope: 1 m/s}}
"""
TWO = FAST.replace("{fast: 1 kHz}", "{fast: 1 kHz, slow: {rate: 200 Hz, offset: 2 ms}}") + (
    "  slow: {block: signal.gain, rate: slow, in: {u: {from: ramp.y, across: sample}}}\n"
)


def diagram(text: str = FAST, **replaced: str) -> Diagram:
    for old, new in replaced.items():
        text = text.replace(old, new)
    return load_text(text)


def busy(paced: Paced, clock: FakeClock, takes: dict[int, float], task: str = "fast") -> list[int]:
    """Let the step of some ticks take so many ms; return a list that gets the ticks that run."""
    ticks: list[int] = []

    def work(tick: int) -> None:
        ticks.append(tick)
        clock.instant += round(takes.get(tick, 0.1) * MS)

    paced.engine.observe(task, work)
    return ticks


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
@pytest.mark.parametrize(("periods", "missed"), [(0.5, 0), (1.0, 0), (1.5, 1), (3.1, 3), (250.5, 250)])
def test_a_step_of_so_many_periods_misses_so_many_ticks_and_the_grid_stays(
    periods: float, missed: int, engine: str
) -> None:
    clock = FakeClock()
    paced = Paced(diagram(), clock, engine=engine)
    ticks = busy(paced, clock, {10: periods})
    starts: list[int] = []
    paced.engine.observe("fast", lambda tick: starts.append(clock.instant))
    times = paced.run(600)["fast"]
    assert ticks == [*range(11), *range(11 + missed, 600)]
    assert (times.steps, times.overruns) == (600 - missed, missed)
    assert times.lateness is not None and times.execution is not None
    assert (times.lateness.least, times.lateness.most) == (0.0, 0.0)
    assert times.execution.most == pytest.approx(max(periods, 0.1) / 1000)
    assert paced.shared.control[control.DONE] == 600 - missed


@given(st.dictionaries(st.integers(0, 99), st.floats(0, 12), max_size=6), st.booleans())
def test_every_due_tick_of_every_task_has_a_step_or_an_overrun(takes: dict[int, float], late: bool) -> None:
    """Steps done and missed are those of the elapsed time, and no step begins before its deadline."""
    clock = FakeClock({place: round(taken * MS) for place, taken in takes.items()} if late else {})
    paced = Paced(diagram(TWO), clock)
    begun: list[tuple[int, int]] = []
    paced.engine.observe("fast", lambda tick: begun.append((tick, clock.instant)))
    busy(paced, clock, {} if late else takes)
    slow: list[int] = []
    paced.engine.observe("slow", slow.append)
    times = paced.run(200)
    assert times["fast"].steps == len(begun)
    assert times["fast"].steps + times["fast"].overruns == 200
    assert times["slow"].steps == len(slow)
    assert times["slow"].steps + times["slow"].overruns == len(range(2, 200, 5))
    assert all(0 <= instant - tick * MS < MS for tick, instant in begun)
    if not late:
        assert all(instant == tick * MS for tick, instant in begun)


def test_a_tick_runs_late_until_the_next_one_is_due() -> None:
    clock = FakeClock({5: MS - 1, 10: MS, 15: 7 * MS + 3})
    paced = Paced(diagram(), clock)
    ticks = busy(paced, clock, dict.fromkeys(range(100), 0.0))
    times = paced.run(100)["fast"]
    assert [tick for tick in range(100) if tick not in ticks] == [10, *range(16, 23)]
    assert times.overruns == 8
    assert times.lateness is not None
    assert times.lateness.most == (MS - 1) / 1e9


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_ticks_are_due_later_or_earlier_as_the_supervisor_shifts_them(engine: str) -> None:
    clock = FakeClock()
    paced = Paced(diagram(), clock, engine=engine)
    starts: list[int] = []
    shifts = {20: 300_000, 60: -200_000}

    def note(tick: int) -> None:
        starts.append(clock.instant)
        paced.shared.control[control.SHIFT] = shifts.get(tick, paced.shared.control[control.SHIFT])

    paced.engine.observe("fast", note)
    times = paced.run(100)["fast"]
    expected = [tick * MS + (0 if tick <= 20 else 300_000 if tick <= 60 else -200_000) for tick in range(100)]
    assert starts == expected
    assert (times.steps, times.overruns) == (100, 0)
    assert times.lateness is not None
    assert times.lateness.most == 0.0


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_how_long_a_step_takes_does_not_depend_on_a_shift_in_the_meantime(engine: str) -> None:
    clock = FakeClock()
    paced = Paced(diagram(), clock, engine=engine)
    shifts = {20: 300_000, 60: -200_000}

    def work(tick: int) -> None:
        clock.instant += MS // 2
        paced.shared.control[control.SHIFT] = shifts.get(tick, paced.shared.control[control.SHIFT])

    paced.engine.observe("fast", work)
    times = paced.run(100)["fast"]
    assert (times.steps, times.overruns) == (100, 0)
    assert times.execution is not None
    assert times.execution.least == times.execution.most == 0.5e-3


def test_time_follows_the_ticks_and_the_period_does_not() -> None:
    clock = FakeClock()
    paced = Paced(diagram(), clock)
    busy(paced, clock, {3: 2.5})
    seen: list[Any] = []
    ramp = paced.engine.bound("ramp")
    paced.engine.observe("fast", lambda tick: seen.append((paced.engine.read("ramp", "y"), ramp.period)))
    paced.run(8)
    assert seen == [(tick / 1000, 0.001) for tick in (0, 1, 2, 3, 6, 7)]


def test_a_tick_of_a_slow_task_that_is_missed_is_an_overrun_of_that_task_too() -> None:
    clock = FakeClock()
    paced = Paced(diagram(TWO), clock)
    ticks = busy(paced, clock, {6: 1.5, 20: 3.0})  # 7 is a tick of the slow task; 21 and 22 are none run late
    slow: list[int] = []
    paced.engine.observe("slow", slow.append)
    times = paced.run(30)
    assert [tick for tick in range(30) if tick not in ticks] == [7, 21, 22]
    assert slow == [2, 12, 17, 27]
    assert (times["fast"].overruns, times["slow"].overruns) == (3, 2)


def test_ticks_without_a_due_task_are_passed_over() -> None:
    text = FAST.replace("{fast: 1 kHz}", "{fast: 10 Hz, odd: 1/15 s}") + (
        "  odd: {block: sources.ramp, rate: odd}\n"
    )
    clock = FakeClock()
    paced = Paced(load_text(text), clock)
    assert paced.engine.period == Fraction(1, 30)
    times = paced.run(31)  # one second
    assert (times["fast"].steps, times["odd"].steps) == (11, 16)
    assert clock.sleeps == 21  # 6 ticks are those of both
    assert (times["fast"].overruns, times["odd"].overruns) == (0, 0)


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_a_run_that_is_to_end_does_so_between_two_steps(engine: str) -> None:
    clock = FakeClock()
    paced = Paced(diagram(), clock, engine=engine)
    ended: list[int] = []

    def work(tick: int) -> None:
        if tick == 4:
            paced.shared.control[control.END] = 1
            ended.append(tick)

    paced.engine.observe("fast", work)
    with pytest.raises(Ended), paced.engine:
        paced.engine.run(100)
    assert paced.engine.tick == 5
    assert paced.times["fast"].steps == 5


# Machine code


def told(engine: str, takes: dict[int, float], late: dict[int, float], limits: OverloadLimits) -> Any:
    """Return all that a run leaves: the ticks that ran, all words, the clock, its message."""
    clock = FakeClock({place: round(time * MS) for place, time in late.items()})
    paced = Paced(diagram(TWO), clock, limits, engine=engine)
    ticks = busy(paced, clock, takes)
    slow: list[int] = []
    paced.engine.observe("slow", slow.append)
    message = ""
    try:
        paced.run(120)
    except RunError as error:
        message = str(error)
    return (
        ticks,
        slow,
        bytes(paced.shared.times),
        bytes(paced.shared.control),
        clock.instant,
        message,
        (paced.shared.notes.left_out.take(last=True).tolist()),
        [ring.take(last=True).tolist() for ring in paced.shared.notes.times],
    )


@pytest.mark.slow
@given(
    st.dictionaries(st.integers(0, 119), st.floats(0, 12), max_size=6),
    st.dictionaries(st.integers(0, 99), st.floats(0, 6), max_size=4),
    st.builds(
        OverloadLimits,
        st.integers(0, 9),
        st.integers(0, 5),
        st.integers(0, 9),
        st.sampled_from(["stop", "warn"]),
    ),
)
@settings(max_examples=40, deadline=None)
def test_the_compiled_pacer_does_what_the_interpreted_one_does(
    takes: dict[int, float], late: dict[int, float], limits: OverloadLimits
) -> None:
    assert told("native", takes, late, limits) == told("python", takes, late, limits)


@pytest.mark.slow
def test_a_compiled_loop_returns_to_python_after_a_signal_and_at_no_other_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = MonotonicClock(time.monotonic_ns())
    paced = Paced(diagram(), clock, engine="native")
    answered: list[int] = []
    monkeypatch.setattr(paced.pacer, "answer", answered.append)
    taken: list[int] = []
    before = signal.signal(signal.SIGUSR1, lambda *_: taken.append(paced.shared.control[control.TICK]))
    clock.hear_signals()
    sender = threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGUSR1))
    try:
        sender.start()
        paced.run(300)
    finally:
        sender.join()
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGUSR1, before)
    assert answered == [SIGNAL]
    assert len(taken) == 1 and 0 < taken[0] < 299


# Overload


def overloaded(takes: dict[int, float], limits: OverloadLimits, text: str = FAST) -> str:
    """Return the message that stops a run; "" if it goes on."""
    clock = FakeClock()
    paced = Paced(load_text(text), clock, limits)
    busy(paced, clock, takes)
    try:
        paced.run(100)
    except RunError as error:
        return str(error)
    return ""


def test_one_overrun_stops_a_run_that_may_have_none() -> None:
    assert overloaded({10: 3.1}, OverloadLimits()) == (
        "t = 0.011 s: task 'fast': overload limit (0) exceeded with 3 overruns: the step of t = 0.01 s took "
        "3.1 ms; make the blocks faster or the rate lower, or allow overruns with the key 'overload'"
    )


def test_a_loop_that_wakes_late_says_so() -> None:
    clock = FakeClock({9: 2 * MS})
    paced = Paced(diagram(), clock, OverloadLimits())
    with pytest.raises(
        RunError, match=r"t = 0.009 s: task 'fast': .* with 2 overruns: the loop woke 2 ms late;"
    ):
        paced.run(100)


@pytest.mark.parametrize(
    ("limits", "takes", "stops"),
    [
        (OverloadLimits(max=3), {10: 3.1}, False),
        (OverloadLimits(max=3), {10: 3.1, 50: 1.5}, True),
        (OverloadLimits(max=2), {10: 3.1}, True),
        (OverloadLimits(max=100, consecutive=2), dict.fromkeys(range(10, 90, 5), 2.5), False),
        (OverloadLimits(max=100, consecutive=1), {10: 2.5}, True),
        (OverloadLimits(startup=5), {4: 3.1}, False),
        (OverloadLimits(startup=5), {5: 3.1}, True),
        (OverloadLimits(startup=0), {0: 1.1}, True),
        (WARN, dict.fromkeys(range(100), 5.0), False),
    ],
)
def test_the_limits_of_xpc_target(limits: OverloadLimits, takes: dict[int, float], stops: bool) -> None:
    assert bool(overloaded(takes, limits)) == stops


def test_where_there_are_computers_an_overload_names_its_own() -> None:
    paced = Paced(diagram(), FakeClock(), OverloadLimits(startup=0), computer="world")
    busy(paced, paced.pacer.clock, {10: 1.5})
    with pytest.raises(RunError, match=r"task 'fast' of 'world': overload limit \(0\) exceeded"):
        paced.run(20)


def test_the_first_steps_of_a_slow_task_may_last() -> None:
    """Ticks 2 and 7 are its first two, when the fast task has long left its own."""
    assert overloaded({2: 3.5, 7: 30.5}, OverloadLimits(startup=2), TWO) == ""
    assert "overload limit (0) exceeded" in overloaded({12: 1.5}, OverloadLimits(startup=2), TWO)
    assert "overload limit (0) exceeded" in overloaded({8: 1.5}, OverloadLimits(startup=2), TWO)


def test_each_task_has_its_own_count() -> None:
    limits = OverloadLimits(max=3, startup=2)
    assert overloaded({6: 1.5, 21: 1.5}, limits, TWO) == ""
    slow = overloaded(dict.fromkeys((16, 21, 26, 31), 1.5), limits._replace(max=2), TWO)
    assert slow.startswith("t = 0.027 s: task 'fast': overload limit (2) exceeded with 3 overruns")
    only = OverloadLimits(max=10, consecutive=1, startup=1)
    assert "task 'slow': overload limit (1 in a row) exceeded with 2 overruns in a row" in overloaded(
        {16: 1.1, 21: 1.1}, only, TWO
    )


def test_a_task_has_limits_of_its_own_and_takes_the_others_from_the_diagram() -> None:
    text = TWO.replace("stop_time", "overload: {max: 2, startup: 1, tasks: {slow: {max: 0}}}\nstop_time")
    limits = load_text(text).overload
    assert limits.of("fast")[:4] == (2, None, 1, "stop")
    assert limits.of("slow")[:4] == (0, None, 1, "stop")
    assert load_text(text).hash == load_text(load_text(text).resolved).hash != load_text(TWO).hash
    assert overloaded({8: 2.5}, limits, TWO) == ""
    assert "task 'slow': overload limit (0) exceeded with 1 overrun" in overloaded({16: 1.5}, limits, TWO)


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_an_overrun_too_many_can_make_the_outputs_safe_and_the_run_goes_on(engine: str) -> None:
    clock = FakeClock()
    limits = OverloadLimits(action="safe", tasks=(TaskLimits("slow", OverloadLimits(max=9), Place("")),))
    paced = Paced(diagram(TWO), clock, limits, engine=engine)
    ticks = busy(paced, clock, {20: 2.5, 30: 1.5})
    held: list[int] = []
    leave = paced.engine.hold_safe
    paced.engine.hold_safe = lambda: (held.append(len(ticks)), leave())  # type: ignore[method-assign]
    times = paced.run(60)
    assert held == [21]
    assert paced.shared.control[control.SAFE] == 1
    assert times["fast"].overruns == 3
    assert paced.pacer.unsafe == "t = 0.021 s: task 'fast': overload limit (0) exceeded with 2 overruns"
