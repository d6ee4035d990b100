"""The profiler of a target by itself: which steps it keeps, and at what cost."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from quadvis.target import profiler
from quadvis.target.profiler import Profiler


def steps(first: int, count: int) -> profiler.Steps:
    return np.arange(first, first + count)[:, np.newaxis] * np.ones(4, np.int64)


def test_the_first_steps_are_kept_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(profiler, "MOST", 5)
    made = Profiler()
    made.start()
    for first, count in ((0, 3), (3, 4), (7, 2)):
        made.take("pc", "fast", steps(first, count))
    made.take("pc", "slow", steps(9, 1))
    assert [(each["task"], each["steps"]) for each in made.facts(0.01)["tasks"]] == [("fast", 5), ("slow", 1)]
    assert [tick for tick, *_ in made.steps(0, 0, 10)] == [0, 1, 2, 3, 4]
    made.start()
    assert made.facts(0.01)["tasks"] == []


def test_to_take_a_step_costs_no_more_after_many() -> None:
    class Many(list[profiler.Steps]):
        """Pieces that nobody is to look through."""

        def __iter__(self) -> Iterator[profiler.Steps]:
            raise AssertionError("all pieces are looked through")

    made = Profiler()
    made.start()
    made._steps["", "slow"] = Many()
    for tick in range(3):
        made.take("", "slow", steps(tick, 1))
    assert made.facts(0.01)["tasks"] == [{"computer": "", "task": "slow", "steps": 3}]
