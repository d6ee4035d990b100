"""Dryden turbulence against its published spectra and correlations."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.plant import dryden
from quadvis_blocks.plant.dryden import Dryden
from tests.stages import mostly_slow

FOOT, KNOT = 0.3048, 1852 / 3600
# In closed form: correlations of the spectra with f, a lag over the scale time L / V, and g of the sides.
CORRELATION = (lambda f: np.exp(-f), lambda g: np.exp(-g) * (1 - g / 2))


def blow(steps: int, rate: float = 10.0, seed: int = 1, **parameters: Any) -> NDArray[np.float64]:
    return np.asarray(drive(Dryden(**parameters), rate=rate, steps=steps, seed=seed).wind)


def published(altitude: float, wind_speed: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Standard deviations (m/s) and scale lengths (m) along u, v, w: MIL-F-8785C, in feet and knots."""
    h, w20 = altitude / FOOT, wind_speed / KNOT
    sigma = 0.1 * w20 * np.array([(0.177 + 0.000823 * h) ** -0.4] * 2 + [1.0]) * KNOT
    return sigma, np.array([h / (0.177 + 0.000823 * h) ** 1.2] * 2 + [h]) * FOOT


def spectra(frequency: Any, sigma: Any, scale: Any) -> NDArray[np.float64]:
    """One-sided power densities of u, v, w ((m/s)^2 s) over frequency (Hz), scale in s."""
    x = 2 * np.pi * np.asarray(frequency)[:, None] * scale
    u = 4 * sigma**2 * scale / (1 + x**2)
    v = 2 * sigma**2 * scale * (1 + 3 * x**2) / (1 + x**2) ** 2
    return np.column_stack((u[:, 0], v[:, 1:]))


def test_the_spectra_and_the_correlations_of_these_tests_belong_together() -> None:
    for axis, correlation in ((0, CORRELATION[0]), (1, CORRELATION[1])):
        for lag in (0.0, 0.7, 2.5):
            power, _ = scipy.integrate.quad(
                lambda f, axis=axis: spectra([f], np.ones(3), np.ones(3))[0, axis], 0, np.inf,
                **({"weight": "cos", "wvar": 2 * np.pi * lag} if lag else {}),
            )  # fmt: skip
            assert power == pytest.approx(correlation(lag), abs=1e-6)


@pytest.mark.parametrize(("altitude", "wind_speed"), [(10 * FOOT, 5.0), (30.0, 10.0), (1000 * FOOT, 15.0)])
def test_its_standard_deviations_are_the_published_ones(altitude: float, wind_speed: float) -> None:
    sigma, scale = published(altitude, wind_speed)
    # Samples ten scale times apart are independent.
    wind = blow(4000, rate=0.1, altitude=altitude, wind_speed=wind_speed, airspeed=float(scale.max()))
    assert wind.std(axis=0) == pytest.approx(sigma, rel=4 / math.sqrt(2 * 4000))
    assert np.abs(np.corrcoef(wind.T) - np.eye(3)).max() < 4 / math.sqrt(4000)


@pytest.mark.parametrize(("rate", "seconds"), mostly_slow([(1.0, 3000), (20.0, 400), (20.0, 3000)], 2))
def test_its_correlations_are_those_of_the_spectra_at_any_rate(rate: float, seconds: int) -> None:
    sigma, scale = published(6.0, 5.0) / np.array([[1.0], [10.0]])  # scale times for an airspeed of 10 m/s
    wind = blow(round(seconds * rate), rate=rate, airspeed=10.0) / sigma
    for axis, forget in enumerate(scale):
        correlation = CORRELATION[min(axis, 1)]
        for lag in (1, 3, 6):
            steps = round(lag * rate)
            found = np.mean(wind[steps:, axis] * wind[:-steps, axis])
            assert found == pytest.approx(correlation(lag / forget), abs=4 * math.sqrt(2 * forget / seconds))


@pytest.mark.parametrize("pieces", mostly_slow([16, 60]))
def test_its_power_densities_are_the_published_ones(pieces: int) -> None:
    sigma, scale = published(15.0, 8.0)
    scale = scale / 20.0
    rate = 20.0
    wind = blow(pieces * 1024, rate=rate, altitude=15.0, wind_speed=8.0, airspeed=20.0)
    frequency, power = scipy.signal.welch(wind, fs=rate, nperseg=2048, axis=0)
    bands = np.geomspace(0.05, 2.0, 9)  # well below the 10 Hz above which sampling folds the tail back
    for low, high in pairwise(bands):
        inside = (frequency >= low) & (frequency < high)
        expected = spectra(frequency[inside], sigma, scale).mean(axis=0)
        spread = 4 / math.sqrt(inside.sum() * pieces)
        assert power[inside].mean(axis=0) == pytest.approx(expected, rel=spread + 0.03)


@pytest.mark.parametrize("share", [1e-7, 1e-4, 0.02, 0.5, 3.0, 19.0, 100.0])
def test_a_step_is_the_matrix_exponential_and_the_noise_that_it_lets_through(share: float) -> None:
    # Van Loan: the exponential of the block matrix holds the transition and the covariance.
    system, noise = np.array([[-1.0, 0.0], [1.0, -1.0]]), np.diag([1.0, 0.0])
    parts = math.ceil(share / 0.5)
    big = scipy.linalg.expm(np.block([[-system, noise], [np.zeros((2, 2)), system.T]]) * share / parts)
    move, covariance = big[2:, 2:].T, big[2:, 2:].T @ big[:2, 2:]
    transition, total = np.eye(2), np.zeros((2, 2))
    for _ in range(parts):
        transition, total = move @ transition, move @ total @ move.T + covariance
    keep, across, left, common, rest = dryden._step(share)
    assert np.array([[keep, 0.0], [across, keep]]) == pytest.approx(transition, rel=1e-9, abs=1e-12)
    factor = np.array([[left, 0.0], [common, rest]])
    assert factor @ factor.T == pytest.approx(total, rel=1e-7)


def test_the_mean_and_the_gusts_along_it_follow_the_direction() -> None:
    turned = {"mean": 3.0, "direction": math.radians(90)}  # blows to the right, along y
    plain, wind = blow(50), blow(50, **turned)
    assert wind[:, 1] == pytest.approx(3.0 + plain[:, 0])
    assert wind[:, 0] == pytest.approx(-plain[:, 1])
    assert np.array_equal(wind[:, 2], plain[:, 2])


def test_it_blows_with_full_strength_from_the_first_sample_on() -> None:
    sigma, _ = published(6.0, 5.0)
    first = np.array([blow(1, seed=seed)[0] for seed in range(400)])
    assert first.std(axis=0) == pytest.approx(sigma, rel=4 / math.sqrt(2 * 400))


def test_the_second_sample_is_correlated_with_the_first_as_any_other() -> None:
    sigma, scale = published(6.0, 5.0)
    pairs = np.array([blow(2, rate=1.0, airspeed=20.0, seed=seed) for seed in range(600)]) / sigma
    found = (pairs[:, 0] * pairs[:, 1]).mean(axis=0)
    forget = 20.0 / scale
    expected = [CORRELATION[min(axis, 1)](forget[axis]) for axis in range(3)]
    assert found == pytest.approx(expected, abs=4 * math.sqrt(2 / 600))


def test_altitudes_beyond_the_model_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"altitude must be at most 304\.8 m, got 400 m"):
        Dryden(altitude=400.0)
