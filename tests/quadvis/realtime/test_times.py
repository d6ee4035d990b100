"""The bins of measured times, and what is read from them."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quadvis.realtime import times
from quadvis.realtime.times import TaskTimes, bin_of, end_of


def words_of(late: list[int], taken: list[int], overruns: int = 0) -> Any:
    words = memoryview(np.zeros(times.WORDS, np.int64))
    times.clear(words)
    for first, second in zip(late, taken, strict=True):
        words[times.STEPS] += 1
        times.count(words, times.LATENESS, first, bin_of(first))
        times.count(words, times.TET, second, bin_of(second))
    words[times.OVERRUNS] = overruns
    return words


@given(st.integers(0, 2**40 - 1))
def test_a_time_is_in_a_bin_of_a_sixteenth_of_it(time: int) -> None:
    number = bin_of(time)
    start, end = end_of(number - 1) if number else 0, end_of(number)
    assert start <= time < end
    assert end - start <= max(1, time / 16)


def test_bins_follow_each_other_and_the_last_takes_all_that_is_longer() -> None:
    assert [bin_of(end_of(number)) for number in range(times.BINS - 1)] == list(range(1, times.BINS))
    assert end_of(times.BINS - 1) == 2**40
    assert bin_of(2**40) == bin_of(2**60) == times.BINS - 1


@given(st.lists(st.integers(0, 2**40 - 1), min_size=1, max_size=300))
def test_the_spread_is_that_of_the_times(found: list[int]) -> None:
    read = TaskTimes.read("a", 0.1, words_of(found, found[::-1], 3))
    assert (read.steps, read.overruns) == (len(found), 3)
    for spread in (read.lateness, read.execution):
        assert spread is not None
        assert (spread.least, spread.most) == (min(found) / 1e9, max(found) / 1e9)
        np.testing.assert_allclose(spread.mean, np.mean(found) / 1e9, rtol=1e-12)
        for part, given_as in ((0.99, spread.p99), (0.999, spread.p999)):
            exact = np.quantile(found, part, method="inverted_cdf") / 1e9
            assert exact <= given_as <= min(exact * 17 / 16 + 1e-9, spread.most)
        edges = [edge for start, end, _ in spread.bins for edge in (start, end)]
        assert edges == sorted(edges)
        counts = [
            sum(start * 1e9 - 0.1 < each < end * 1e9 - 0.1 for each in found) for start, end, _ in spread.bins
        ]
        assert counts == [count for _, _, count in spread.bins] and sum(counts) == len(found)
        facts = spread.facts()["histogram"]
        assert [tuple(each.values()) for each in facts] == list(spread.bins)


def test_a_task_without_a_step_has_no_times() -> None:
    read = TaskTimes.read("a", 0.1, words_of([], [], 2))
    assert (read.steps, read.overruns, read.lateness, read.execution) == (0, 2, None, None)
    assert read.facts() == {"period_s": 0.1, "steps": 0, "overruns": 2, "lateness": None, "execution": None}
