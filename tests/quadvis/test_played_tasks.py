"""Tasks that run each by itself, repeated: the same signals to the bit, whatever was late or never begun."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.engine.engine import Engine
from quadvis.native.choice import choose
from quadvis.realtime.streams import streams_of
from quadvis.run.playback import RecordedClock
from quadvis.run.played_tasks import PlayedTasks, begins
from tests.quadvis.realtime.fakes import CrewClock, Paced
from tests.quadvis.realtime.test_crew import BLOCKS, TASKS, busy, diagram
from tests.quadvis.realtime.test_streams import Kept
from tests.stages import mostly_slow

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
engines = pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
COUNT = 80
Takes = dict[str, dict[int, float]]


def repeated(engine: str, takes: Takes) -> tuple[list[Kept], list[Kept], dict[str, int]]:
    """Run a crew whose steps take so long (ms), and repeat it; return the rows of both, and its overruns."""
    made, clock, taps = diagram(), CrewClock(), [Kept(block) for block in BLOCKS]
    pairs = streams_of(made.graph, taps)
    paced = Paced(made, clock, streams=[stream for stream, _ in pairs], engine=engine)
    for task, long in takes.items():
        busy(paced, clock, task, long)
    times = paced.run(COUNT)
    for (stream, group), ring in zip(pairs, paced.shared.rings, strict=True):
        stream.hand_on(ring.take(last=True), group)
    notes = paced.shared.notes
    left_out, releases = notes.left_out.take(last=True), notes.releases.take(last=True)
    again, others = Engine(made.graph, made.seed), [Kept(block) for block in BLOCKS]
    begun = [begins(made.graph, number, left_out, releases, COUNT) for number in (1, 2)]
    choice = choose(again, COUNT, engine)
    again.clock = RecordedClock(left_out, [], lambda _: None)
    again.run_with(lambda interpreter: PlayedTasks(interpreter, choice, begun))
    for tap in others:
        again.attach(tap)
    with again:
        for end in (7, 8, COUNT):
            again.run(end - again.tick)
    return taps, others, {name: found.overruns for name, found in times.items()}


@engines
def test_an_injected_schedule_is_repeated_to_the_bit(engine: str) -> None:
    """Late begins, overruns of one task, of both at once, of the fastest too, and at the end of the run."""
    takes: Takes = {
        "fast": {10: 3.1, 31: 12.2, 78: 5.0},
        "mid": {0: 3.9, 20: 9.5, 48: 4.5},
        "slow": {2: 9.9, 32: 25.0, 62: 14.0},
    }
    first, second, overruns = repeated(engine, takes)
    assert all(overruns.values())
    assert [tap.rows for tap in first] == [tap.rows for tap in second]
    simulation, taps = Engine(diagram().graph, 3), [Kept(block) for block in BLOCKS]
    for tap in taps:
        simulation.attach(tap)
    with simulation:
        simulation.run(COUNT)
    for tap, one in zip(taps[1:], first[1:], strict=True):
        differ = [tick for tick, row in one.rows.items() if tap.rows[tick] != row]
        assert differ or tap.block in ("ramp", "time")  # else the schedule would prove nothing


LONG = st.dictionaries(st.integers(0, COUNT - 1), st.floats(0.1, 30.0), max_size=5)


@settings(max_examples=25, deadline=None)
@given(st.fixed_dictionaries({name: LONG for name in TASKS}))
def test_any_schedule_is_repeated_to_the_bit(takes: Takes) -> None:
    first, second, _ = repeated("python", takes)
    assert [tap.rows for tap in first] == [tap.rows for tap in second]


def test_a_tick_that_nobody_noted_and_the_fastest_left_out_did_not_begin() -> None:
    graph = diagram().graph
    left_out, none = np.array([[11, 3]]), np.zeros((0, 4), np.int64)
    assert begins(graph, 1, left_out, none, 21).tolist() == [[0, 0], [4, 4], [8, 8], [16, 16], [20, 20]]
    late = np.array([[1, 12, 0, 14], [2, 2, 1, -1]])
    assert [12, 14] in begins(graph, 1, left_out, late, 21).tolist()
    assert [12, 14] not in begins(graph, 1, left_out, late, 14).tolist()
    assert begins(graph, 2, left_out, late, 30).tolist() == [[22, 22]]


def test_nonsense_from_a_damaged_log_is_not_met_by_an_exception() -> None:
    graph, none = diagram().graph, np.zeros((0, 2), np.int64)
    nonsense = np.array([[1, -9, 3, 2], [1, 4, -2, 9], [1, 8, 2**40, 3], [1, 0, 0, 2**40], [7, 1, 1, 1]])
    assert begins(graph, 1, none, nonsense, 21).tolist() == [[4, 4]]
