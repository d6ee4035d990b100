"""The times of blocks' calls in a loop that goes on: from which tick on they are taken, and to which."""

from __future__ import annotations

import sys
from collections import Counter

import pytest

from quadvis.api import load_text
from quadvis.realtime import control
from quadvis.realtime.streams import streams_of
from tests.quadvis.realtime.fakes import CrewClock, Paced
from tests.quadvis.realtime.steered import Steered
from tests.quadvis.realtime.test_crew import BLOCKS, TEXT, simulated
from tests.quadvis.realtime.test_streams import Kept

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")

engines = pytest.mark.parametrize("engine", ["python", "native"])
taskings = pytest.mark.parametrize("tasking", ["single", "multi"])


def measured(paced: Paced, changes: dict[int, int]) -> list[Counter[str] | None]:
    """Begin and end measurements at ticks of a run; return the calls of blocks found at each of them."""
    found: list[Counter[str] | None] = []
    words = paced.shared.control

    def look(tick: int) -> None:
        if tick in changes:
            report = paced.profiles.report(paced.engine.timed_methods, words[control.MEASUREMENT])
            counted = Counter({each.block: 0 for each in report.methods}) if report else None
            for each in report.methods if report else ():
                counted[each.block] = max(counted[each.block], each.calls)
            found.append(counted)
            words[control.MEASUREMENT] = changes[tick]

    paced.engine.observe("fast", look)
    return found


@engines
@taskings
def test_calls_are_timed_from_the_tick_behind_one_to_another(engine: str, tasking: str) -> None:
    """The signals are those of a run that nobody measures; a new measurement begins anew."""
    made = load_text(TEXT.replace("tasking: multi", f"tasking: {tasking}"))
    clock, taps = CrewClock(), [Kept(block) for block in BLOCKS]
    pairs = streams_of(made.graph, taps)
    paced = Paced(made, clock, streams=[stream for stream, _ in pairs], engine=engine)
    paced.engine.prepare()
    found = measured(paced, {10: 1, 50: 2, 71: 3, 79: 5, 91: 6, 100: 6})
    paced.run(101)
    for (stream, group), ring in zip(pairs, paced.shared.rings, strict=True):
        stream.hand_on(ring.take(last=True), group)
    assert [tap.rows for tap in taps] == simulated(made, 101)
    none, first, again, third, last, still = found
    assert none is None
    # From tick 11 to 50, from 72 to 79, from 80 to 91. What is due at the end has not run when it is read.
    for counts, fast, mid, slow in ((first, 40, 10, 4), (third, 8, 2, 1), (last, 12, 3, 1)):
        assert counts is not None
        assert (counts["wave"], counts["ramp"], counts["time"]) == (fast, mid, slow)
        assert counts.keys() == set(BLOCKS)
    assert (again, still) == (first, last)


def flown(run: Steered, ticks: int) -> None:
    """Wait so many ticks."""
    end = run.helm.tick + ticks
    run.until(lambda: run.helm.tick > end)


@engines
def test_a_flying_application_is_measured_and_flies_on(engine: str) -> None:
    text = TEXT.replace("tasking: multi", "tasking: single").replace("stop_time: 100 s", "stop_time: 20 s")
    with Steered(load_text(text), engine) as run:
        run.reach("ready")
        run.helm.begin()
        run.until(lambda: run.helm.tick > 20)
        assert run.helm.block_times() == {}
        for _ in range(2):
            before = run.helm.tick
            run.helm.measure(True)
            flown(run, 200)
            run.until(lambda: len(run.helm.block_times()) == 1)
            run.helm.measure(False)
            flown(run, 50)  # the loop has seen it, whatever its steps take
            times = run.helm.block_times()[""]
            wave = next(each for each in times.report.methods if each.block == "wave")
            assert 0 < wave.calls <= run.helm.tick - before
            assert times.offset >= before * 10**6
            flown(run, 100)
            assert run.helm.block_times()[""].report.methods == times.report.methods
        run.helm.stop()
        result = run.end()
    assert result.flight is not None
    assert result.flight.engine.engine == engine
    (share,) = result.flight.shares
    assert share.blocks is not None
    assert share.blocks.report.methods == times.report.methods


def test_a_run_that_has_ended_has_its_times() -> None:
    with Steered(load_text(TEXT.replace("tasking: multi", "tasking: single"))) as run:
        run.helm.measure(True)
        run.reach("ready")
        run.helm.begin()
        run.until(lambda: run.helm.tick > 20)
        run.helm.stop()
        run.end()
        (times,) = run.helm.block_times().values()
        assert {each.block for each in times.report.methods} == set(BLOCKS)
        assert times.offset >= 0  # no call of the warm ticks before the start is among them
