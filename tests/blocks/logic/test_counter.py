"""Tests of the block logic.counter."""

import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.logic.counter import Counter

U = [bool(u) for u in (1, 0, 1, 1, 0, 1, 0, 1)]


@pytest.mark.parametrize(
    ("count_on", "wanted"),
    [
        ("rising", [0, 0, 1, 1, 1, 2, 2, 3]),
        ("falling", [0, 1, 1, 1, 2, 2, 3, 3]),
        ("either", [0, 1, 2, 2, 3, 4, 5, 6]),
        ("level", [1, 1, 2, 3, 3, 4, 4, 5]),
    ],
)
def test_it_counts_at_the_tick_of_an_edge_and_the_start_is_none(count_on: str, wanted: list[int]) -> None:
    assert drive(Counter(count_on=count_on), u=U).y.tolist() == wanted


@pytest.mark.parametrize(
    ("at_limit", "down", "wanted"),
    [
        ("hold", False, [1, 2, 3, 3, 3]),
        ("wrap", False, [1, 2, 3, -1, 0]),
        ("hold", True, [-1, -1, -1, -1, -1]),
        ("wrap", True, [-1, 3, 2, 1, 0]),
    ],
)
def test_beyond_a_limit_it_stays_or_goes_on_from_the_other(
    at_limit: str, down: bool, wanted: list[int]
) -> None:
    block = Counter(count_on="level", lower=-1, upper=3, at_limit=at_limit)
    assert drive(block, u=[True] * 5, down=[down] * 5).y.tolist() == wanted


def test_a_reset_counts_before_an_edge() -> None:
    reset = [False, False, True, False, False]
    y = drive(Counter(count_on="level", initial=5), u=[True] * 5, reset=reset).y
    assert y.tolist() == [6, 7, 5, 6, 7]


def test_an_initial_count_beyond_the_limits_is_refused() -> None:
    with pytest.raises(ParameterError, match="initial must be at most upper, 3, got 4"):
        Counter(initial=4, upper=3)
    with pytest.raises(ParameterError, match="lower must be at most initial, 0, got 1"):
        Counter(lower=1)
