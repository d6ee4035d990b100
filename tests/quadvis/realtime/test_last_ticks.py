"""At the stop time: who waits for whom, and how long."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from quadvis.realtime import last_ticks
from quadvis.realtime.last_ticks import LastTicks


def test_nobody_leaves_before_all_have_run_their_last_tick_and_all_give_signs_of_life_until_then() -> None:
    words, left, signs = [0, 0, 0], [threading.Event() for _ in range(3)], [0, 0, 0]

    def live(place: int) -> bool:
        signs[place] += 1
        return True

    def run(place: int) -> None:
        LastTicks(words, place).stay(0.0, 0.002, lambda: live(place))
        left[place].set()

    threads = [threading.Thread(target=run, args=(place,)) for place in range(3)]
    for count, thread in enumerate(threads, 1):
        thread.start()
        if count < 3:
            before = list(signs)
            while any(now < then + 5 for now, then in zip(signs[:count], before[:count], strict=True)):
                time.sleep(0.001)
            assert not any(event.is_set() for event in left)
    for thread in threads:
        thread.join()
    assert words == [1, 1, 1]


def test_a_run_that_is_to_end_waits_for_nobody() -> None:
    answers: Iterator[bool] = iter([True, True, False])
    LastTicks([0, 0], 1).stay(0.0, 0.001, lambda: next(answers))
    assert list(answers) == []


def test_without_a_supervisor_the_wait_ends_some_time_after_the_stop_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(last_ticks, "LONGEST_STAY", 0.05)
    begun = time.monotonic()
    LastTicks([0, 0], 0).stay(0.1, 0.001, lambda: True)
    assert time.monotonic() - begun >= 0.15
