"""Tests of the block logic.latch."""

import pytest

from quadvis.testing import drive
from quadvis_blocks.logic.latch import Latch

SET, RESET = [0, 1, 0, 1, 0, 1, 0], [0, 0, 0, 1, 0, 0, 1]


@pytest.mark.parametrize(
    ("priority", "wanted"), [("reset", [0, 1, 1, 0, 0, 1, 0]), ("set", [0, 1, 1, 1, 1, 1, 0])]
)
def test_it_is_true_from_set_to_reset_and_one_of_them_has_priority(priority: str, wanted: list[int]) -> None:
    y = drive(Latch(priority=priority), set=[bool(x) for x in SET], reset=[bool(x) for x in RESET]).y
    assert y.tolist() == [bool(each) for each in wanted]


def test_it_begins_as_it_is_told() -> None:
    assert drive(Latch(initial=True), set=[False] * 2, reset=[False, True]).y.tolist() == [True, False]
