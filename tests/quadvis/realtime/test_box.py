"""Groups of new values on their way into the memory of a loop, by a clock that stands still."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.engine.memory import SLOT
from quadvis.realtime import box as boxes
from quadvis.realtime import control, dispatch, pacing, plan
from quadvis.realtime.box import NUMBER, ParameterBox
from quadvis.realtime.notes import Notes
from quadvis.realtime.pacer import Ended
from quadvis.realtime.words import whole_words
from tests.quadvis.realtime.fakes import CrewClock, FakeClock, Paced
from tests.quadvis.realtime.test_crew import MS, busy
from tests.quadvis.realtime.test_crew import diagram as crew_diagram
from tests.quadvis.realtime.test_pacer import TWO
from tests.quadvis.realtime.test_pacer import diagram as paced_diagram
from tests.stages import mostly_slow

engines = pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))


def word(value: float) -> int:
    return int(np.float64(value).view(np.int64))


def put(paced: Paced, values: dict[tuple[str, str], float], tasks: int = -1, not_before: int = 0) -> int:
    entries = [(paced.engine.slot(*name).position, [word(value)]) for name, value in values.items()]
    return paced.shared.box.put(entries, tasks, not_before)


def noted(paced: Paced) -> list[list[int]]:
    return np.array(paced.shared.notes.groups.take(last=True)).tolist()


@engines
def test_a_group_holds_whole_from_the_tick_that_is_noted(engine: str) -> None:
    clock = FakeClock({30: 5 * MS})
    paced = Paced(paced_diagram(TWO), clock, engine=engine)
    seen: dict[int, tuple[float, float]] = {}

    def look(tick: int) -> None:
        if tick == 10:
            put(paced, {("ramp", "slope"): 3.0, ("slow", "factor"): 4.0})
        if tick == 20:
            put(paced, {("ramp", "slope"): 5.0, ("slow", "factor"): 6.0}, not_before=31)
        seen[tick] = paced.engine.read("ramp", "slope"), paced.engine.read("slow", "factor")

    paced.engine.observe("fast", look)
    paced.run(50)
    assert 31 not in seen and noted(paced) == [[1, 11], [2, min(tick for tick in seen if tick > 31)]]
    second = next(tick for tick in seen if tick > 31)
    for tick, values in seen.items():
        assert values == ((1.0, 1.0) if tick <= 10 else (3.0, 4.0) if tick < second else (5.0, 6.0))


def test_a_group_that_is_not_whole_waits() -> None:
    """Some processors show the number of a group before its words."""
    paced = Paced(paced_diagram(), FakeClock())

    def spoil(tick: int) -> None:
        words = paced.shared.box.words
        if tick == 5:
            put(paced, {("ramp", "slope"): 3.0})
            words[boxes.HEAD + boxes.ENTRY] += 1
        elif tick == 8:
            words[boxes.HEAD + boxes.ENTRY] -= 1

    paced.engine.observe("fast", spoil)
    paced.run(20)
    assert noted(paced) == [[1, 9]]


@given(st.integers(1, 2**40), st.integers(0, 2**53 - 1), st.integers(1, boxes.ANSWERS - 1))
def test_the_answer_is_that_to_the_newest_group(number: int, tick: int, before: int) -> None:
    made = ParameterBox(memoryview(bytearray(SLOT * ParameterBox.size(8))).cast("q"), 8)
    made.words[NUMBER] = number - 1
    assert made.put([(0, [1])], 0) == number
    if number % boxes.ANSWERS:
        assert made.taken(number) is None
    notes, memory = whole_words(Notes.size([])), whole_words(1)
    pacing._take(whole_words(plan.HEAD), made.words, notes, whole_words(dispatch.HEAD), memory, tick)
    assert made.taken(number) == tick
    assert made.taken(number + before) is None


@given(st.lists(st.integers(-(2**63), 2**63 - 1), min_size=1, max_size=8), st.data())
def test_the_check_sees_any_word_that_is_another_one(words: list[int], data: st.DataObject) -> None:
    made = ParameterBox(memoryview(bytearray(SLOT * ParameterBox.size(64))).cast("q"), 64)
    made.put([(17, words)], 3, 5)
    place = data.draw(st.integers(0, len(words) - 1))
    other = data.draw(st.integers(-(2**63), 2**63 - 1).filter(lambda value: value != words[place]))
    before = boxes.check(made.words, made.words[NUMBER])
    made.words[boxes.HEAD + boxes.ENTRY + place] = other
    low = (other ^ words[place]) & boxes.LOW  # the upper bits of all but the last word are not looked at
    assert (boxes.check(made.words, made.words[NUMBER]) != before) or not low


@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
@engines
def test_a_group_of_a_slower_task_waits_until_this_task_is_at_rest(engine: str) -> None:
    clock = CrewClock()
    paced = Paced(crew_diagram(), clock, engine=engine)
    busy(paced, clock, "slow", {12: 4.5})  # it runs until 17 is due
    busy(paced, clock, "mid", {16: 2.5})
    seen: dict[int, Any] = {}

    def look(tick: int) -> None:
        if tick == 13:
            put(paced, {("deep", "time_constant"): 7.0, ("wave", "amplitude"): 2.0}, 0b101)
        seen[tick] = paced.engine.read("deep", "time_constant"), paced.engine.read("wave", "amplitude")

    paced.engine.observe("fast", look)
    paced.run(40)
    ((number, tick),) = noted(paced)
    assert (number, tick) == (1, 17)  # though 'mid' runs then
    assert all(values == ((7.0, 2.0) if each >= 17 else (0.02, 1.0)) for each, values in seen.items())


def test_nothing_is_taken_once_the_run_is_to_end() -> None:
    paced = Paced(paced_diagram(), FakeClock())
    put(paced, {("ramp", "slope"): 3.0})
    paced.shared.control[control.END] = 1
    with pytest.raises(Ended):
        paced.run(20)
    assert noted(paced) == []
