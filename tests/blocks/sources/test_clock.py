"""Tests of the block sources.clock."""

from quadvis.testing import drive
from quadvis_blocks.sources.clock import Clock


def test_it_is_the_time() -> None:
    driven = drive(Clock(), rate="10 Hz", steps=5)
    assert driven.y.tolist() == driven.time.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
