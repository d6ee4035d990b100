"""Tests of the block logic.on_delay."""

import numpy as np

from quadvis.testing import drive
from quadvis_blocks.logic.on_delay import OnDelay


def test_what_is_true_from_the_start_counts_from_the_start() -> None:
    driven = drive(OnDelay(delay=2.0), u=[True] * 40, rate="10 Hz")
    assert np.array_equal(driven.y, driven.time >= 2.0 - 1e-12)


def test_a_break_begins_anew_and_false_counts_at_once() -> None:
    u = [False, True, True, False, True, True, True, True, False]
    assert drive(OnDelay(delay=2.0), u=u).y.tolist() == [False] * 6 + [True, True, False]


def test_without_a_delay_it_is_its_input() -> None:
    assert drive(OnDelay(delay=0.0), u=[True, False, True]).y.tolist() == [True, False, True]
