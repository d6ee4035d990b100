import math

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.plant.gust import Gust
from tests.stages import mostly_slow


@pytest.mark.parametrize(("rate", "seconds"), mostly_slow([(2, 2000), (20, 400), (20, 2000)], 2))
def test_it_has_its_deviation_mean_and_correlation_at_any_rate(rate: int, seconds: int) -> None:
    wind = drive(Gust(rms=(0.2, 0.5, 0.0), mean=(1.0, 0.0, -1.0)), rate=rate, steps=seconds * rate).wind
    samples = seconds / (2 * 2.0)  # independent ones in the run: length over twice the correlation time
    assert wind.mean(axis=0) == pytest.approx([1.0, 0.0, -1.0], abs=4 * 0.5 / math.sqrt(samples))
    assert wind.std(axis=0) == pytest.approx([0.2, 0.5, 0.0], rel=4 / math.sqrt(2 * samples))
    gust = wind[:, 1]
    lagged = np.corrcoef(gust[2 * rate :], gust[: -2 * rate])[0, 1]  # two seconds: one correlation time
    assert lagged == pytest.approx(math.exp(-1.0), abs=4 / math.sqrt(samples))


def test_axes_are_independent() -> None:
    wind = drive(Gust(correlation_time=0.1), rate="1 Hz", steps=5000).wind
    assert np.abs(np.corrcoef(wind.T) - np.eye(3)).max() < 4 / math.sqrt(5000)


def test_it_blows_with_full_strength_from_the_first_sample_on() -> None:
    first = np.concatenate([drive(Gust(), steps=1, seed=seed).wind[0] for seed in range(300)])
    assert first.std() == pytest.approx(0.2, rel=4 / math.sqrt(2 * 900))


def test_a_step_changes_the_mean_wind_once_and_not_the_gusts() -> None:
    calm = drive(Gust(), rate="10 Hz", steps=20, seed=3).wind
    stepped = drive(Gust(step=(6.0, 0.0, -1.0), step_time=0.7), rate="10 Hz", steps=20, seed=3).wind
    assert stepped[:7].tolist() == calm[:7].tolist()
    assert stepped[7:] - calm[7:] == pytest.approx(np.tile([6.0, 0.0, -1.0], (13, 1)))


def test_a_negative_strength_is_refused() -> None:
    with pytest.raises(ParameterError, match="rms must be at least 0 m/s, got -1 m/s"):
        Gust(rms=(0.2, -1.0, 0.2))
