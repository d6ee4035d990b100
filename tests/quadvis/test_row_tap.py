"""The taps of a run, above all of a real-time run that has left out ticks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.api import load_text
from quadvis.output.kept import RowJudge
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.run.row_tap import PacedTap, RowTap, Taker
from quadvis.run.verdict import Judging, Verdict

DIAGRAM = load_text("""\
quadvis: 1
name: rows
rates: {base: 100 Hz, slow: {rate: 50 Hz, offset: 10 ms}}
stop_time: 2 s
blocks:
  base: {block: sources.sine, rate: base}
  wave: {block: sources.sine, rate: slow}
expect:
  - {signal: wave.y, within: 1000}
  - {signal: wave.y, after: 0.5 s, before: 1 s, within: 1000}
""")
TICKS = range(1, DIAGRAM.ticks, 2)  # the block's own


def judged(ticks: list[int], pieces: list[int], *, whole: bool = True) -> tuple[list[Verdict], list[int]]:
    """Judge a run with these ticks, whose rows come in pieces; return the verdicts and all stamps (ns)."""
    judging = Judging(DIAGRAM.summary, DIAGRAM.expectations)
    judge = RowJudge(RecordedBlock("/wave", (RecordedPort("y"),)), judging)
    stamps: list[int] = []
    takers = [
        Taker(judge.take, judge.take_all),
        Taker(lambda stamp, _: stamps.append(stamp), lambda some, _: stamps.extend(some.tolist())),
    ]
    row = RowTap("wave", 1, DIAGRAM.graph.tick, takers)
    tap = PacedTap(row, DIAGRAM.graph["wave"], DIAGRAM.graph, judge)
    for some in np.split(np.array(ticks), pieces):
        if len(some) == 1:
            tap.take(int(some[0]), memoryview(np.array([float(some[0])])).cast("B"))
        elif len(some):
            tap.take_all(some, some.astype(float).reshape(-1, 1).view(np.int64))
    if whole:
        tap.end(DIAGRAM.ticks)
    judge.flush()
    return list(judging.outcome().verdicts), stamps


@given(st.sets(st.sampled_from(TICKS)), st.lists(st.integers(0, 100), max_size=5))
def test_rows_are_judged_by_their_ticks_and_those_that_do_not_exist_are_no_lack(
    missing: set[int], pieces: list[int]
) -> None:
    ticks = [tick for tick in TICKS if tick not in missing]
    verdicts, stamps = judged(ticks, sorted(pieces))
    assert stamps == [tick * 10_000_000 for tick in ticks]
    for verdict, inside in zip(verdicts, (ticks, [tick for tick in ticks if 50 <= tick <= 100]), strict=True):
        assert verdict.met == bool(inside)
        if inside:
            assert verdict.found == max(inside)
            assert verdict.lack == ""


def test_rows_that_have_not_come_are_a_lack() -> None:
    whole, cut = (judged(list(TICKS)[:-3], [], whole=whole)[0] for whole in (True, False))
    assert [verdict.met for verdict in whole] == [True, True]
    assert [verdict.met for verdict in cut] == [False, True]
    assert cut[0].lack == "97 of its 100 samples are there"


@pytest.mark.parametrize("missing", [set(), {3, 5}])
def test_a_run_in_which_no_tick_ran_is_not_judged(missing: set[int]) -> None:
    verdicts, _ = judged([tick for tick in TICKS if tick > 100 and tick not in missing], [])
    assert [verdict.met for verdict in verdicts] == [True, False]
    assert verdicts[1].shown == "nothing to judge: 0 of its 25 samples are there"
