"""Recorded runs played back: their ticks, their computers, and how they ended."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import quadvis
from quadvis import read_log, replay
from quadvis.diagram.diagram import Diagram
from quadvis.engine.tuning import Change
from quadvis.errors import QuadvisError, RunError
from quadvis.links.endpoints import live_parts
from quadvis.run.loops import REAL_TIME, Simulated
from quadvis.run.playback import RecordedClock
from quadvis.run.session import recorded
from tests.quadvis.relogged import TEXT, flipped, flown, rewritten, write_flight


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_flight()


@given(
    st.sets(st.integers(0, 59)),
    st.lists(st.integers(0, 59), max_size=5),
    st.integers(1, 60),
)
def test_the_ticks_and_the_changes_of_the_recorded_run_come_again(
    missing: set[int], changed: list[int], size: int
) -> None:
    runs: list[list[int]] = []
    for tick in sorted(missing):
        if runs and runs[-1][0] + runs[-1][1] == tick and tick % 7:  # neighbours may be noted apart
            runs[-1][1] += 1
        else:
            runs.append([tick, 1])
    told: list[str] = []
    changes = [Change(tick, "block", str(tick), 0.0) for tick in changed if tick not in missing]
    clock = RecordedClock(
        np.array(runs, np.int64).reshape(-1, 2), changes, lambda some: told.extend(each.name for each in some)
    )
    tick, ran, seen = 0, list[int](), list[tuple[int, str]]()
    while tick < 60:
        due = clock.wait(tick, min(60, tick - tick % size + size))
        seen += [(due.start, name) for name in told]
        told.clear()
        ran += due
        tick = due.stop
    assert ran == [tick for tick in range(60) if tick not in missing]
    assert seen == sorted((change.tick, change.name) for change in changes)


def test_nonsense_from_a_damaged_log_does_not_stand_still() -> None:
    nonsense = np.array([[-5, 3], [2, -9], [4, 2], [4, 2**40], [9, 0]], np.int64)
    clock = RecordedClock(nonsense, [], lambda change: None)
    tick = waits = 0
    while tick < 100:
        due = clock.wait(tick, 100)
        assert due.stop > tick
        tick, waits = due.stop, waits + 1
    assert waits < 10


FAILING = '''
"""A block that fails."""

from quadvis.block import Block, Out, Param


class Failing(Block):
    """Fails when it is updated after an instant."""

    begin = Param(1.0, unit="s")
    y = Out()

    def output(self):
        return self.begin

    def update(self, time):
        if time > self.begin:
            raise ValueError("no such luck")
'''


@pytest.mark.usefixtures("folder")
def test_a_run_that_failed_is_the_same_up_to_its_end() -> None:
    Path("blocks/own/failing.py").write_text(FAILING)
    Path("flight.yaml").write_text(TEXT.replace("log:", "  failing: {block: own.failing, rate: fast}\nlog:"))
    with pytest.raises(RunError, match="no such luck"):
        flown()
    found = replay("run.mcap", output="new.mcap")
    assert found.same and not found.whole and found.time == pytest.approx(1 + 1 / 30)
    assert read_log("new.mcap").complete
    with pytest.raises(RunError, match="no such luck"):
        replay("run.mcap", settings=["failing.begin=0.5 s"])


class Flown(Simulated):
    """A simulation that claims to be a real-time run of all computers of its diagram."""

    clock = REAL_TIME

    def __init__(self, diagram: Diagram) -> None:
        super().__init__(diagram, "python", None)
        parts = live_parts(diagram.graph)
        self.computers, self.graphs = parts, [*parts.values()]


@pytest.mark.usefixtures("folder")
def test_each_computer_is_replayed_by_itself() -> None:
    text = TEXT.replace("seed: 7", "seed: 7\ncomputers: {left: {}, right: {}}")
    for block in ("noise", "outside", "sum"):
        text = text.replace(f"  {block}: {{", f"  {block}: {{at: left, ")
    for block in ("filter", "slow"):
        text = text.replace(f"  {block}: {{", f"  {block}: {{at: right, ")
    write_flight(text)
    diagram = quadvis.load("flight.yaml")
    recorded(diagram, Flown(diagram), log="run.mcap")
    topics = {block.path for block in read_log("run.mcap").hidden.blocks}
    link = "left_to_right_fast"
    names = ("inputs/outside", f"inputs/{link}", "left_out/left", "left_out/right")
    assert topics == {f"/_replay/{name}" for name in names}
    found = replay("run.mcap", output="new.mcap")
    assert found.same and found.ticks == 2 * 61
    assert set(found.played) == {"outside", link}  # what the other computer sends comes from the log
    assert replay("new.mcap").same
    log = rewritten(read_log("run.mcap"), flipped(f"/_replay/inputs/{link}", 30, 0, bit=50))
    assert {each.difference.signal for each in replay(log).differences} == {"filter.y", "slow.y"}


@pytest.mark.usefixtures("folder")
def test_what_no_log_holds_between_ticks_is_refused() -> None:
    block = Path("blocks/own/outside.py")
    text = block.read_text().replace(", numeric=False", "").replace("def read(self)", "def open(self)")
    block.write_text(text)
    Path("flight.yaml").write_text(
        TEXT.replace("outside, rate: fast", "outside, rate: continuous")
        .replace("seed: 7", "seed: 7\nsolver: {method: ode4, step: 1/60 s}")
        .replace("outside.y]", "{from: outside.y, across: sample}]")
    )
    flown()
    with pytest.raises(QuadvisError, match="block 'outside' reaches outside and moves between two ticks"):
        replay("run.mcap")
