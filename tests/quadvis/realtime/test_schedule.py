"""Deadlines and due tasks, against a list of all ticks."""

from __future__ import annotations

from fractions import Fraction
from math import floor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.api import load_text
from quadvis.diagram.sections.overload import OverloadLimits
from quadvis.realtime import grid
from quadvis.realtime.plan import make_plan
from quadvis.realtime.schedule import Rhythm, Schedule

PERIODS = st.fractions(Fraction(1, 10**6), Fraction(1, 3), max_denominator=10**6)
RHYTHMS = st.lists(st.builds(Rhythm, st.integers(1, 7), st.integers(0, 9)), min_size=1, max_size=3)
COUNT = 60


def due(rhythm: Rhythm, tick: int) -> bool:
    return tick >= rhythm.offset and (tick - rhythm.offset) % rhythm.every == 0


@given(PERIODS, RHYTHMS, st.integers(0, 30), st.fractions(-2, 30))
def test_the_next_and_the_latest_due_tick_are_those_of_a_list(
    period: Fraction, rhythms: list[Rhythm], tick: int, where: Fraction
) -> None:
    schedule = Schedule(period, rhythms)
    instant = floor(where * period * 10**9)
    ticks = [each for each in range(COUNT) if any(due(rhythm, each) for rhythm in rhythms)]
    deadline = {each: floor(each * period * 10**9) for each in range(COUNT)}
    assert all(schedule.deadline(each) == deadline[each] for each in deadline)
    plan = make_plan(schedule, [OverloadLimits()] * len(rhythms), [1] * len(rhythms))
    assert all(grid.deadline(plan, each) == deadline[each] for each in deadline)
    assert grid.following(plan, tick, instant) == min(
        each for each in ticks if each >= tick and deadline[each] >= instant
    )
    assert grid.latest(plan, instant) == max(
        (each for each in ticks if deadline[each] <= instant), default=-1
    )


@given(st.builds(Rhythm, st.integers(1, 7), st.integers(0, 9)), st.integers(0, 40), st.integers(0, 40))
def test_the_number_of_due_ticks_is_counted(rhythm: Rhythm, start: int, length: int) -> None:
    stop = start + length
    assert grid.due_in(*rhythm, start, stop) == sum(due(rhythm, each) for each in range(start, stop))


@pytest.mark.parametrize("rate", ["3 Hz", "1/7 s", "1 kHz"])
def test_the_grid_has_no_drift_in_a_year(rate: str) -> None:
    head = f"quadvis: 1\nname: a\nstop_time: 1 s\nrates: {{it: {rate}}}\n"
    graph = load_text(head + "blocks: {w: {block: sources.sine, rate: it}}\n").graph
    schedule = Schedule.of(graph)
    year = 365 * 24 * 3600
    tick = floor(year / graph.tick)
    assert schedule.deadline(tick) == floor(tick * graph.tick * 10**9)
    plan = make_plan(schedule, [OverloadLimits()], [1])
    assert grid.deadline(plan, tick) == schedule.deadline(tick)
    assert grid.following(plan, 0, year * 10**9 - 10**9) - tick == pytest.approx(-1 / graph.tick, abs=1)
    assert schedule.interval == floor(graph.tick * 10**9)
