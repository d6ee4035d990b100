"""What the guardian sees of a loop."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from quadvis.diagram.sections.overload import OverloadLimits
from quadvis.realtime import control
from quadvis.realtime.heartbeat import Heartbeat, Patience, Sign
from quadvis.realtime.schedule import Rhythm, Schedule

MS = 10**6
START = 10**9
SCHEDULE = Schedule(Fraction(1, 100), [Rhythm(1, 2), Rhythm(5, 3)])  # 100 Hz from 20 ms on, 20 Hz


class Loop:
    """A loop by its words, at instants (ms since the start)."""

    def __init__(self, **limits: object) -> None:
        self.words = np.zeros(control.WORDS, np.int64)
        self.instant = -5
        allowed = OverloadLimits(**limits)  # type: ignore[arg-type]
        patience = Patience.of("target", self.words, SCHEDULE, allowed)
        self.heart = Heartbeat(patience, lambda: START + MS * self.instant)

    def start(self) -> Loop:
        self.words[control.START] = START
        assert self.look(-5) is Sign.WELL
        return self

    def begin(self, instant: int) -> None:
        self.words[control.BEGUN] = MS * instant

    def end(self) -> None:
        self.words[control.BEGUN] = 0
        self.words[control.DONE] += 1

    def look(self, instant: int) -> Sign:
        self.instant = instant
        return self.heart.look()


def test_before_the_start_a_loop_may_be_silent() -> None:
    assert Loop().look(10**6) is Sign.WELL


def test_before_the_start_a_loop_may_be_silent_though_its_ticks_are_to_be_due_later() -> None:
    loop = Loop()
    loop.words[control.SHIFT] = 1000
    assert [loop.look(instant) for instant in (0, 10**6)] == [Sign.WELL, Sign.WELL]


def test_a_step_that_does_not_end_hangs_after_two_periods() -> None:
    loop = Loop(startup=0).start()
    for instant in range(20, 100, 10):
        loop.begin(instant)
        assert loop.look(instant + 4) is Sign.WELL
        loop.end()
    loop.begin(100)
    assert [loop.look(instant) for instant in (110, 120, 121)] == [Sign.WELL, Sign.WELL, Sign.HANGS]
    assert loop.heart.complaint == "the loop of 'target' has given no sign of life for 0.02 s"


def test_a_loop_that_does_not_wake_hangs_after_two_periods() -> None:
    loop = Loop(startup=0).start()
    loop.begin(20)
    loop.end()
    assert [loop.look(instant) for instant in (24, 40, 44, 45)] == [
        Sign.WELL,
        Sign.WELL,
        Sign.WELL,
        Sign.HANGS,
    ]


def test_the_first_tick_may_be_late_by_its_offset() -> None:
    loop = Loop(startup=0).start()
    assert [loop.look(instant) for instant in (40, 41)] == [Sign.WELL, Sign.HANGS]


def test_ticks_that_may_be_missed_in_a_row_prolong_it() -> None:
    for limits in ({"max": 3}, {"max": 100, "consecutive": 3}):
        loop = Loop(startup=0, **limits).start()
        loop.begin(100)
        assert [loop.look(instant) for instant in (150, 151)] == [Sign.WELL, Sign.HANGS]


def test_in_the_first_steps_and_with_warnings_a_loop_pauses_and_may_go_on() -> None:
    loop = Loop(startup=2).start()  # the slower task has made two steps after 120 ms
    loop.begin(20)
    assert [loop.look(instant) for instant in (41, 120)] == [Sign.PAUSES] * 2
    loop.end()
    assert loop.look(120) is Sign.WELL
    loop.begin(130)
    assert loop.look(151) is Sign.HANGS
    warned = Loop(startup=0, action="warn").start()
    warned.begin(500)
    assert warned.look(521) is Sign.PAUSES


def test_a_loop_that_waits_for_others_after_its_last_tick_gives_signs_of_life() -> None:
    loop = Loop(startup=0).start()
    loop.begin(20)
    for instant in range(20, 500, 15):
        loop.end()
        assert loop.look(instant) is Sign.WELL
    assert loop.look(530) is Sign.HANGS


@pytest.mark.parametrize("word", [control.END, control.LEFT, control.SAFE])
def test_an_end_is_seen_whatever_the_loop_does(word: int) -> None:
    loop = Loop().start()
    loop.words[word] = 1
    assert loop.look(0) is Sign.ENDS
