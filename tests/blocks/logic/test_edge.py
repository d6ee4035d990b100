"""Tests of the block logic.edge."""

import pytest

from quadvis.testing import drive
from quadvis_blocks.logic.edge import Edge

U = [1, 1, 0, 0, 1, 0, 1, 1]


@pytest.mark.parametrize(
    ("direction", "wanted"),
    [
        ("rising", [0, 0, 0, 0, 1, 0, 1, 0]),
        ("falling", [0, 0, 1, 0, 0, 1, 0, 0]),
        ("either", [0, 0, 1, 0, 1, 1, 1, 0]),
    ],
)
def test_a_change_is_true_for_one_tick_and_the_start_is_none(direction: str, wanted: list[int]) -> None:
    assert drive(Edge(direction=direction), u=[bool(u) for u in U]).y.tolist() == [
        bool(each) for each in wanted
    ]


def test_a_restored_snapshot_makes_no_edge() -> None:
    driven = drive(Edge(), u=[False, True, True])
    engine = driven.engine
    snapshot = engine.snapshot()
    with engine:
        engine.restore(snapshot)
        engine.run(1)
        assert engine.read("block", "y") is False
