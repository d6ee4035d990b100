"""Tests of the block sources.uniform_noise."""

import numpy as np
import pytest
from scipy.stats import kstest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.uniform_noise import UniformNoise


def test_all_numbers_between_the_limits_are_equally_likely() -> None:
    y = drive(UniformNoise(lower=-2.0, upper=3.0), steps=4000).y
    assert (y > -2.0).all() and (y < 3.0).all()
    assert kstest(y, "uniform", args=(-2.0, 5.0)).pvalue > 0.01


def test_elements_are_independent_and_have_limits_of_their_own() -> None:
    y = drive(UniformNoise(lower=[0.0, -1.0], upper=[1.0, 5.0]), steps=4000).y
    assert y.shape == (4000, 2) and (y >= [0.0, -1.0]).all() and (y <= [1.0, 5.0]).all()
    assert abs(np.corrcoef(y.T)[0, 1]) < 0.05


def test_the_seed_decides() -> None:
    first, again, other = (drive(UniformNoise(), steps=20, seed=seed).y for seed in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_limits_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ParameterError, match="lower must be at most upper, 1, got 2"):
        UniformNoise(lower=2.0)
