"""The shares of the second stage: together they are all tests, and a name says to which one it belongs."""

from types import SimpleNamespace
from typing import Any

import pytest

from tests.stages import share

ITEMS: list[Any] = [
    SimpleNamespace(nodeid=f"tests/test_{file}.py::test[{case}]") for file in "abc" for case in range(400)
]


@pytest.mark.parametrize("shares", [1, 2, 5, 12])
def test_every_test_is_in_one_share_and_none_is_much_larger(shares: int) -> None:
    parts = [share(ITEMS, f"{number}/{shares}") for number in range(1, shares + 1)]
    assert sorted(item.nodeid for mine, _ in parts for item in mine) == sorted(item.nodeid for item in ITEMS)
    for mine, others in parts:
        assert len(mine) + len(others) == len(ITEMS)
        assert abs(len(mine) - len(ITEMS) / shares) < 0.3 * len(ITEMS) / shares


def test_a_test_stays_in_its_share_and_the_order_stays() -> None:
    mine, _ = share(ITEMS, "2/5")
    fewer, _ = share(ITEMS[::2], "2/5")
    assert fewer == [item for item in mine if item in ITEMS[::2]]


@pytest.mark.parametrize("which", ["", "0/5", "6/5", "2", "2/0", "-1/5", "a/b", "1/5 ", "٢/5"])
def test_what_is_no_share_is_refused(which: str) -> None:
    with pytest.raises(pytest.UsageError, match="write which share of how many, such as 2/5"):
        share(ITEMS, which)
