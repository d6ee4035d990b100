import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.noise import Noise


def test_noise_has_its_mean_and_standard_deviation_and_is_white() -> None:
    y = drive(Noise(sigma=2.0, mean=5.0), steps=20000).y
    assert np.mean(y) == pytest.approx(5.0, abs=4 * 2.0 / np.sqrt(20000))
    assert np.std(y) == pytest.approx(2.0, rel=4 / np.sqrt(40000))
    assert abs(np.corrcoef(y[1:], y[:-1])[0, 1]) < 4 / np.sqrt(20000)


def test_elements_have_their_own_deviation_and_are_independent() -> None:
    y = drive(Noise(sigma=[1.0, 0.0, 3.0]), steps=10000).y
    assert np.std(y, axis=0) == pytest.approx([1.0, 0.0, 3.0], rel=0.03)
    assert abs(np.corrcoef(y[:, 0], y[:, 2])[0, 1]) < 0.04


def test_the_seed_decides_the_numbers() -> None:
    first, again, other = (drive(Noise(), steps=5, seed=seed).y.tolist() for seed in (1, 1, 2))
    assert first == again and not set(first) & set(other)


def test_a_negative_deviation_is_refused() -> None:
    with pytest.raises(ParameterError, match="sigma must be at least 0"):
        Noise(sigma=-0.1)
