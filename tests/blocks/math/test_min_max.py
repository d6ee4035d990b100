"""Tests of the block math.min_max."""

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.math.min_max import MinMax


@pytest.mark.parametrize(("function", "wanted"), [("min", np.min), ("max", np.max)])
def test_it_is_the_smallest_or_largest_of_any_number(function: str, wanted: object) -> None:
    u = np.random.default_rng(1).normal(size=(4, 20, 3))
    assert callable(wanted)
    for count in (1, 2, 4):
        terms = u[:count]
        assert np.array_equal(drive(MinMax(function=function), u=list(terms)).y, wanted(terms, axis=0))
        one = terms[:, :, 0]
        assert np.array_equal(drive(MinMax(function=function), u=list(one)).y, wanted(one, axis=0))


def test_a_constant_is_a_limit() -> None:
    assert drive(MinMax(function="max"), u=[[-1.0, 2.0], 0.0]).y.tolist() == [0.0, 2.0]
