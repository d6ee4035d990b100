import math
from typing import Any

import numpy as np
import pytest

from quadvis_vision.calibrate.memory_noise import fit, whitened

TRUE = np.array((1.0, -2.0))


def design(count: int) -> Any:
    """Two rows of values; the unknowns are a mean and a swing."""
    swing = np.sin(0.9 * np.arange(count))
    return np.stack((np.ones((count, 2)), np.column_stack((swing, -swing))), axis=2)


def noisy(seed: int, count: int, white: float, lasting: float, duration: float) -> Any:
    """Values with white noise and a first-order Gauss-Markov process, at intervals of 1 s."""
    rng = np.random.default_rng(seed)
    keep = math.exp(-1 / duration)
    drift, rows = rng.normal(size=2), []
    for _ in range(count):
        rows.append(lasting * drift)
        drift = keep * drift + math.sqrt(1 - keep * keep) * rng.normal(size=2)
    return design(count) @ TRUE + np.array(rows) + white * rng.normal(size=(count, 2))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_whitened_columns_have_the_products_of_the_dense_covariance(share: float) -> None:
    rng = np.random.default_rng(1)
    times, duration = np.cumsum(rng.uniform(0.1, 3.0, 12)), 2.5
    columns = rng.normal(size=(12, 2, 3))
    apart = np.abs(times[:, None] - times)
    covariance = share * np.exp(-apart / duration) + (1 - share) * np.eye(12)
    white, volume = whitened(times, columns, np.array([share]), np.array([duration]))
    for row in range(2):
        expected = columns[:, row].T @ np.linalg.solve(covariance, columns[:, row])
        assert white[0, :, row].T @ white[0, :, row] == pytest.approx(expected)
    assert volume[0] == pytest.approx(2 * np.linalg.slogdet(covariance)[1])


def test_values_without_errors_give_the_unknowns() -> None:
    found, covariance = fit(np.arange(30.0), design(30), design(30) @ TRUE)
    assert found == pytest.approx(TRUE)
    assert np.diag(covariance).max() < 1e-20


@pytest.mark.parametrize(("white", "lasting"), [(1.0, 0.0), (1.0, 0.5), (0.1, 1.0)])
def test_the_errors_of_many_fits_are_as_large_as_the_covariance_says(white: float, lasting: float) -> None:
    scores = []
    for seed in range(30):
        found, covariance = fit(np.arange(80.0), design(80), noisy(seed, 80, white, lasting, 15.0))
        scores.append((found - TRUE) / np.sqrt(np.diag(covariance)))
    size = np.sqrt(np.mean(np.square(scores), axis=0))
    assert np.all(size > 0.4) and np.all(size < 1.5)
    assert np.abs(scores).max() < 4.0


def test_errors_that_last_are_not_averaged_away() -> None:
    calm = fit(np.arange(80.0), design(80), noisy(1, 80, 1.0, 0.0, 15.0))[1]
    slow = fit(np.arange(80.0), design(80), noisy(1, 80, 0.1, 1.0, 15.0))[1]
    assert slow[0, 0] > 4 * calm[0, 0]  # of the mean
    assert slow[1, 1] < calm[1, 1] / 4  # of the swing, which is faster than they are


def test_what_the_design_does_not_determine_has_an_infinite_variance() -> None:
    twice = np.repeat(design(20)[:, :, :1], 2, axis=2)
    found, covariance = fit(np.arange(20.0), twice, design(20) @ TRUE)
    assert found.tolist() == [0.0, 0.0] and np.isinf(np.diag(covariance)).all()
