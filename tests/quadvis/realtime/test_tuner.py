"""Groups of new values for several computers, whose loops take them whenever they like."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.engine.engine import Engine
from quadvis.engine.tuning import Change, NewValue
from quadvis.errors import QuadvisError
from quadvis.links.endpoints import live_parts
from quadvis.realtime import dispatch, pacing, plan
from quadvis.realtime.box import NUMBER, ParameterBox
from quadvis.realtime.helm import Wanted
from quadvis.realtime.notes import Notes
from quadvis.realtime.tuner import BEFORE, Tuned, Tuner, box_room
from quadvis.realtime.words import whole_words

TEXT = """\
quadvis: 1
name: tuned
rates: {base: 100 Hz}
stop_time: 1 s
computers: {near: {}, far: {}}
links: {line: {from: near, to: far, via: memory}}
blocks:
  source: {at: near, block: sources.constant, rate: base, with: {value: 1}}
  one: {at: near, block: signal.saturation, rate: base, in: {u: source.y}}
  two: {at: far, block: signal.saturation, rate: base, in: {u: one.y}}
"""
DIAGRAM = load_text(TEXT)


class Loop:
    """The loop of a computer: it has a box, memory, and the ring in which it notes what it has taken."""

    def __init__(self, computer: str) -> None:
        part = DIAGRAM.graph.part_of(computer)
        self.engine, room = Engine(live_parts(DIAGRAM.graph)[computer]), box_room(part)
        self.box = ParameterBox(whole_words(ParameterBox.size(room)), room)
        self.notes = Notes(whole_words(Notes.size([])), [])
        self.tuned = Tuned(part, self.box, self.engine.program.tunables)
        self._plan, self._crew = whole_words(plan.HEAD), whole_words(dispatch.HEAD)

    def step(self, tick: int) -> None:
        memory = self.engine.memory.raw.cast("q")
        if self.box.words[NUMBER] != self._plan[plan.TAKEN]:
            pacing._take(self._plan, self.box.words, self.notes.words, self._crew, memory, tick)


class Rig:
    def __init__(self) -> None:
        self.loops = {name: Loop(name) for name in ("near", "far")}
        self.changes: list[Change] = []
        tuned = {name: loop.tuned for name, loop in self.loops.items()}
        self.tuner = Tuner(tuned, DIAGRAM.graph.tick, self.changes.append)
        self.tick = 0

    def offer(self, *values: tuple[str, str, Any]) -> Future[int]:
        wanted = Wanted(tuple(NewValue(*each) for each in values), Future())
        self.tuner.offer(wanted, self.tick)
        return wanted.future

    def look(self, *, notes: bool = True) -> None:
        self.tuner.answer()
        for name, loop in self.loops.items() if notes else ():
            self.tuner.noted(name, np.array(loop.notes.groups.take(last=True)))
        self.tuner.send(self.tick)

    def step(self, *computers: str, notes: bool = True) -> None:
        self.tick += 1
        for name in computers:
            self.loops[name].step(self.tick)
        self.look(notes=notes)


values = st.tuples(st.sampled_from(["one", "two"]), st.sampled_from(["lower", "upper"]), st.floats(-2.0, 2.0))
groups = st.lists(values, min_size=1, max_size=3)
steps = st.tuples(st.sampled_from([("near",), ("far",), ("near", "far")]), st.booleans())


@given(st.lists(st.one_of(groups, steps), max_size=25))
def test_every_accepted_group_holds_in_its_order_and_no_other_does(plan: list[Any]) -> None:
    rig = Rig()
    offered: list[tuple[list[tuple[str, str, float]], Future[int]]] = []
    model = {(block, "lower"): -1.0 for block in ("one", "two")} | {
        (block, "upper"): 1.0 for block in ("one", "two")
    }
    for each in plan:
        if isinstance(each, tuple):
            rig.step(*each[0], notes=each[1])
            continue
        new = model | {(block, name): value for block, name, value in each}
        future = rig.offer(*each)
        if all(new[block, "lower"] <= new[block, "upper"] for block in ("one", "two")):
            model = new
            offered.append((each, future))
        else:
            with pytest.raises(ParameterError, match="lower must be at most upper"):
                future.result(0)
        rig.look(notes=False)
    for _ in range(60):
        rig.step("near", "far")
    assert not rig.tuner.waits_for
    ticks = [future.result(0) for _, future in offered]
    for (group, _), tick in zip(offered, ticks, strict=True):
        for block, name, value in dict.fromkeys(group):
            last = [other for one, other_name, other in group if (one, other_name) == (block, name)][-1]
            assert value != last or any(
                change[1:] == (block, name, value) and change.tick <= tick for change in rig.changes
            )
    for (block, name), value in model.items():
        assert rig.loops["near" if block == "one" else "far"].engine.read(block, name) == value


def test_who_waits_for_a_tick_has_it_before_the_notes_come_with_the_rows() -> None:
    rig = Rig()
    for number in range(600):  # more than there are different answers
        future = rig.offer(("one", "upper", 2.0 + number), ("one", "lower", 1.0))
        rig.look(notes=False)
        assert not future.done()
        rig.step("near", notes=False)
        assert future.result(0) == rig.tick == number + 1
    assert rig.changes == []
    rig.look()
    assert [change.tick for change in rig.changes] == [tick for tick in range(1, 601) for _ in range(2)]
    assert [change.value for change in rig.changes[::2]] == [2.0 + number for number in range(600)]


def test_what_waits_goes_together_and_other_computers_do_not_wait() -> None:
    rig = Rig()
    first = rig.offer(("one", "upper", 2.0))
    rig.look()
    second, third = rig.offer(("one", "upper", 3.0)), rig.offer(("one", "upper", 4.0))
    other = rig.offer(("two", "upper", 5.0))
    rig.look()
    rig.step("far")
    assert (other.result(0), first.done()) == (1, False)
    rig.step("near")
    assert (first.result(0), second.done()) == (2, False)
    rig.step("near")
    assert (second.result(0), third.result(0)) == (3, 3)
    assert [change[1:] for change in rig.changes if change.path == "one"] == [
        ("one", "upper", 2.0), ("one", "upper", 3.0), ("one", "upper", 4.0),
    ]  # fmt: skip


def test_a_group_of_two_computers_holds_from_one_tick_on() -> None:
    rig = Rig()
    rig.offer(("one", "upper", 2.0), ("two", "upper", 2.0))
    rig.tuner.send(BEFORE)
    for loop in rig.loops.values():
        loop.step(0)
    rig.look()
    rig.tick = 10
    later = rig.offer(("one", "upper", 3.0), ("two", "upper", 3.0))
    rig.look()
    while not later.done():
        rig.step("near", "far")
    assert later.result(0) == 12
    assert [change.tick for change in rig.changes] == [0, 0, 12, 12]


def test_who_still_waits_at_the_end_is_told_and_a_cancelled_group_does_nothing() -> None:
    rig = Rig()
    cancelled: Future[int] = Future()
    cancelled.cancel()
    rig.tuner.offer(Wanted((NewValue("one", "upper", 9.0),), cancelled), 0)
    assert rig.offer().result(0) == 0
    flying = rig.offer(("one", "upper", 2.0))
    rig.look()
    waiting = rig.offer(("one", "upper", 3.0))
    rig.tuner.end()
    for future in (flying, waiting):
        with pytest.raises(QuadvisError, match="the run has ended"):
            future.result(0)
    assert rig.changes == []
