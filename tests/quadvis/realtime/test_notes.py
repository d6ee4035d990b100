"""What a loop notes: the records of each kind, whatever else is noted in between, and the times of tasks."""

from __future__ import annotations

import sys
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.realtime import notes
from quadvis.realtime.notes import Notes, put_group, put_left_out, put_release, put_times
from tests.quadvis.realtime.fakes import CrewClock, FakeClock, Paced
from tests.quadvis.realtime.test_crew import TASKS, busy, diagram
from tests.quadvis.realtime.test_pacer import TWO
from tests.quadvis.realtime.test_pacer import busy as busy_alone
from tests.quadvis.realtime.test_pacer import diagram as diagram_alone
from tests.stages import mostly_slow

MS = 1_000_000
engines = pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))


@given(
    st.lists(st.integers(1, 5), min_size=1, max_size=3),
    st.lists(st.one_of(st.integers(0, 5), st.just("take")), max_size=40),
)
def test_each_kind_has_its_own_records_and_loses_what_finds_no_room(
    rooms: list[int], actions: list[int | str]
) -> None:
    words = memoryview(np.zeros(Notes.size(rooms) + 1, np.int64))
    words[-1] = 77
    loop, other = Notes(words[:-1], rooms), Notes(words[:-1], rooms)
    starts = loop.starts
    rings = [other.left_out, other.groups, other.releases, *other.times]
    waiting: list[deque[list[int]]] = [deque() for _ in rings]
    limits = [*3 * [notes.ROOM], *rooms]
    number = 0
    for action in actions:
        if action == "take":
            for ring, queue in zip(rings, waiting, strict=True):
                found = ring.take(last=True).tolist()
                assert found == list(queue)
                queue.clear()
            continue
        kind, number = int(action) % len(rings), number + 1
        record = [number, -number, 2 * number, 7][: 2 if kind < 2 else 4]
        if kind == 0:
            put_left_out(loop.words, number, -number)
        elif kind == 1:
            put_group(loop.words, number, -number)
        elif kind == 2:
            put_release(loop.words, *record)
        else:
            put_times(loop.words, starts[kind - 3], rooms[kind - 3], *record)
        if len(waiting[kind]) < limits[kind]:
            waiting[kind].append(record)
    assert words[-1] == 77


@engines
def test_the_times_of_each_step_are_noted_with_the_overruns_up_to_it(engine: str) -> None:
    clock = FakeClock({3: round(0.25 * MS)})
    paced = Paced(diagram_alone(TWO), clock, engine=engine)
    busy_alone(paced, clock, {5: 2.5})
    found = paced.run(20)
    for name, ring in zip(found, paced.shared.notes.times, strict=True):
        records = ring.take(last=True)
        assert len(records) == found[name].steps
        assert records[-1, 3] <= found[name].overruns
        lateness, execution = found[name].lateness, found[name].execution
        assert lateness is not None and execution is not None
        assert (records[:, 1].max() / 1e9, records[:, 2].max() / 1e9) == (lateness.most, execution.most)
        assert (np.diff(records[:, 0]) > 0).all() and (np.diff(records[:, 3]) >= 0).all()


@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
@engines
def test_tasks_of_their_own_note_their_times_and_what_they_missed(engine: str) -> None:
    clock = CrewClock()
    paced = Paced(diagram(), clock, engine=engine)
    ran = {
        "fast": busy(paced, clock, "fast", {10: 3.1}),  # 11, 12 and 13 are lost; 12 is one of both others
        "mid": busy(paced, clock, "mid", {20: 9.5}),  # 24 and 28 are overruns
        "slow": busy(paced, clock, "slow", {32: 10.5}),  # 42
    }
    times = paced.run(60)
    records = {name: ring.take(last=True) for name, ring in zip(TASKS, paced.shared.notes.times, strict=True)}
    for name, ticks in ran.items():
        assert records[name][:, 0].tolist() == ticks and len(ticks) == times[name].steps
    slow = {tick: (late, overruns) for tick, late, _, overruns in records["slow"].tolist()}
    assert slow[12] == (2 * MS, 0) and slow[52] == (0, 1)
    missed = paced.shared.notes.releases.take(last=True).tolist()
    assert missed == [[1, 12, 0, 14], [2, 12, 0, 14], [1, 24, 1, -1], [1, 28, 1, -1], [2, 42, 1, -1]]
