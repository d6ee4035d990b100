"""The twins: a frame comes when closed forms say; as many are lost as are asked for."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from quadvis.engine.engine import Engine
from quadvis.graph.graph import MULTI, Task
from quadvis.links.insertion import signal_names
from quadvis.links.link import MEMORY, Link
from quadvis.native.choice import NATIVE, choose, use

from .networks import made_link, network, rows, task

FAST, SLOW, LATE = task("fast", "1/20"), task("slow", "1/10"), task("late", "1/10", "1/50")
MILLI = task("milli", "1/1000")
COUNT, AGE, LOST, REFUSED = 1, 9, 10, 11  # places in a row


def ran(
    link: Link, source: Task, reader: Task, ticks: int, seed: int = 1, tasking: str = "single"
) -> np.ndarray:
    return np.array(rows(Engine(network(link, source, reader, tasking), seed), ticks))


def ticks_of(a_task: Task, until: Fraction) -> list[Fraction]:
    found = [a_task.offset]
    while found[-1] + a_task.period <= until:
        found.append(found[-1] + a_task.period)
    return found


PAIRS = [(SLOW, FAST), (FAST, SLOW), (SLOW, SLOW), (LATE, FAST), (SLOW, LATE), (SLOW, MILLI)]


@pytest.mark.parametrize("tasking", ["single", MULTI])
@pytest.mark.parametrize("baud", [0, 10600, 20000, 115200])
@pytest.mark.parametrize(("source", "reader"), PAIRS, ids=lambda each: each.name)
def test_a_frame_comes_once_its_bytes_are_through(
    source: Task, reader: Task, baud: int, tasking: str
) -> None:
    link = made_link(source, reader, baud=baud) if baud else made_link(source, reader, baud=0, via=MEMORY)
    assert link.share <= 1.0
    found = ran(link, source, reader, 400 if reader is MILLI else 60, tasking=tasking)
    latency = Fraction(link.bytes * 10, baud) if baud else Fraction(0)
    sent = ticks_of(source, Fraction(13))
    for row in found:
        now = Fraction(row[0]).limit_denominator(10**6)
        come = [at for at in sent if at < now and at + latency <= now]
        assert row[COUNT] == max(0, len(come) - 1)
        assert row[AGE] == pytest.approx(float(now - (come[-1] if come else 0)), abs=1e-9)
    assert (found[:, [LOST, REFUSED]] == 0).all()


def test_a_line_in_use_all_the_time_gives_each_frame_one_period_later() -> None:
    link = made_link(SLOW, SLOW, baud=5300)
    assert link.share == 1.0
    found = ran(link, SLOW, SLOW, 300)
    np.testing.assert_array_equal(found[:, COUNT], np.maximum(0, np.arange(300) - 1))
    np.testing.assert_allclose(found[1:, AGE], 0.1, atol=1e-9)


def test_before_the_first_message_the_values_are_the_initial_ones() -> None:
    found = ran(made_link(SLOW, FAST), SLOW, FAST, 2)
    assert found[0].tolist() == [0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]


def test_as_many_frames_are_lost_as_are_asked_for() -> None:
    count, share = 2000, 0.2
    found = ran(made_link(SLOW, SLOW, baud=115200, loss=share), SLOW, SLOW, count)
    assert abs(found[-1, LOST] - share * count) < 4 * math.sqrt(count * share * (1 - share))
    assert found[-1, REFUSED] == 0
    # What is lost is missing: the counter of the source and the number of frames that came agree.
    steps = np.diff(found[:, COUNT])
    assert (np.diff(found[:, LOST]) == np.where(steps > 1, steps - 1, 0)).all()
    ages = found[:, AGE]
    assert ages.max() > 0.25 and np.allclose(ages / 0.1, np.round(ages / 0.1))


def test_a_frame_with_a_wrong_bit_is_refused_and_missing() -> None:
    count, flips = 2000, 5e-4
    link = made_link(SLOW, SLOW, baud=115200, flips=flips)
    share = 1 - (1 - flips) ** (8 * link.bytes)
    assert link.spoilt == pytest.approx(share, rel=1e-12)
    found = ran(link, SLOW, SLOW, count)
    assert abs(found[-1, REFUSED] - share * count) < 4 * math.sqrt(count * share * (1 - share))
    # Each refused one is counted as lost once a later one has come.
    later = found[:, REFUSED] - found[:, LOST]
    assert later.min() >= 0 and (later == 0).mean() > 0.5


def test_all_frames_spoilt_are_all_refused() -> None:
    found = ran(made_link(SLOW, SLOW, baud=115200, flips=1.0), SLOW, SLOW, 50)
    assert found[:, REFUSED].tolist() == list(range(50)) and (found[:, COUNT] == 0).all()


def test_jitter_makes_frames_late_evenly_and_keeps_their_order() -> None:
    jitter = 0.05
    link = made_link(SLOW, MILLI, baud=115200, jitter=jitter)
    found = ran(link, SLOW, MILLI, 10_000)
    news = np.flatnonzero(np.diff(found[:, COUNT])) + 1
    assert (np.diff(found[:, COUNT])[news - 1] == 1).all()
    late = found[news, AGE] - link.latency
    assert late.min() >= 0.0 and late.max() <= jitter + 2e-3
    assert late.mean() == pytest.approx(jitter / 2 + 0.5e-3, abs=4 * jitter / math.sqrt(12 * news.size))


def test_jitter_of_several_periods_delays_and_loses_nothing() -> None:
    found = ran(made_link(SLOW, SLOW, baud=115200, jitter=0.35), SLOW, SLOW, 500)
    assert (found[:, LOST] == 0).all() and (np.diff(found[:, COUNT]) >= 0).all()
    assert found[-1, COUNT] >= 494 and np.diff(found[:, COUNT]).max() > 1


def test_one_seed_gives_one_run_and_another_seed_another() -> None:
    link = made_link(SLOW, FAST, loss=0.3, jitter=0.02, flips=1e-4)
    first, second, other = (ran(link, SLOW, FAST, 400, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, second)
    assert (first != other).any()


@pytest.mark.slow
@pytest.mark.parametrize(("source", "reader"), PAIRS, ids=lambda each: each.name)
def test_machine_code_gives_the_same_bits(source: Task, reader: Task) -> None:
    link = made_link(source, reader, baud=20000, loss=0.2, jitter=0.03, flips=1e-4)
    plain = ran(link, source, reader, 500)
    engine = Engine(network(link, source, reader), 1)
    choice = choose(engine, 500, NATIVE)
    assert choice.engine == NATIVE and not choice.reason
    use(engine, choice)
    np.testing.assert_array_equal(np.array(rows(engine, 500)), plain)


def test_signals_keep_the_names_of_their_ports_where_they_can() -> None:
    assert signal_names([("a", "y"), ("b", "z")]) == ["y", "z"]
    assert signal_names([("a", "y"), ("part/b", "y"), ("c", "z")]) == ["a_y", "part_b_y", "z"]
    assert signal_names([("a", "age"), ("b", "stamps"), ("c", "jitter"), ("ring", "x")]) == [
        "a_age", "b_stamps", "c_jitter", "x",
    ]  # fmt: skip
    assert signal_names([("ring", "lost"), ("ring", "age")]) == ["signal_0", "signal_1"]
