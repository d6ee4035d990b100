import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are
from scipy.stats import chi2

from quadvis.testing import Driven, drive
from quadvis_blocks.estimation.attitude_filter import AttitudeFilter
from tests.stages import mostly_slow

STEP = 0.01
RATE = "100 Hz"
ANGLE, GYRO, TORQUE, WANDER, DRIFT = 2e-3, 8e-3, 0.02, 0.03, 1e-3
START = (0.05, 0.05, 0.1, 0.01)
MODEL: dict[str, Any] = {
    "angle_noise": ANGLE, "rate_noise": GYRO, "torque_noise": TORQUE, "disturbance_wander": WANDER,
    "bias_wander": DRIFT, "initial_sigma": START, "gate": 50.0,
}  # fmt: skip
SIGHT = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0]])


def model() -> tuple[np.ndarray, np.ndarray]:
    """Transition and process noise over a tick, by Van Loan's matrix exponential."""
    rates = np.zeros((4, 4))
    rates[0, 1] = rates[1, 2] = 1.0
    density = np.diag([0.0, TORQUE**2, WANDER**2, DRIFT**2])
    both = expm(STEP * np.block([[-rates, density], [np.zeros((4, 4)), rates.T]]))
    transition = both[4:, 4:].T
    return transition, transition @ both[:4, 4:]


def turn(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """True states (count, 4), torques that were commanded, measured angles and rates."""
    rng = np.random.default_rng(seed)
    transition, noise = model()
    root = np.linalg.cholesky(noise)
    torque = np.repeat(rng.normal(0.0, 0.5, count // 5), 5)
    states = np.zeros((count, 4))
    states[0] = rng.normal(size=4) * START
    for k in range(count - 1):
        pushed = torque[k] * np.array([STEP**2 / 2, STEP, 0.0, 0.0])
        states[k + 1] = transition @ states[k] + pushed + root @ rng.normal(size=4)
    measured = states @ SIGHT.T + rng.normal(size=(count, 2)) * (ANGLE, GYRO)
    return states, torque, measured[:, 0], measured[:, 1]


def estimate(angle: Any, gyro: Any, torque: Any, **more: Any) -> Driven:
    block = AttitudeFilter(**{**MODEL, **more.pop("parameters", {})})
    return drive(block, angle=angle, gyro=gyro, torque=torque, rate=RATE, **more)


def states_of(result: Driven) -> np.ndarray:
    return np.stack([result.estimate, result.angular_rate, result.disturbance, result.bias], axis=1)


def test_in_the_long_run_its_covariance_is_that_of_the_algebraic_riccati_equation() -> None:
    _, torque, angle, gyro = turn(1, 5000)
    result = estimate(angle, gyro, torque)
    transition, noise = model()
    spread = np.diag([ANGLE**2, GYRO**2])
    prior = solve_discrete_are(transition.T, SIGHT.T, noise, spread)
    gain = prior @ SIGHT.T @ np.linalg.inv(SIGHT @ prior @ SIGHT.T + spread)
    assert result.covariance[-1] == pytest.approx(prior - gain @ SIGHT @ prior, rel=1e-3)


@pytest.mark.parametrize("count", mostly_slow([16, 60]))
def test_its_errors_are_as_large_as_its_covariance_says(count: int) -> None:
    runs = []
    for seed in range(count):
        states, torque, angle, gyro = turn(10 + seed, 150)
        runs.append((states, estimate(angle, gyro, torque)))
    low, high = chi2.ppf([0.0005, 0.9995], 4 * len(runs))
    for tick in (0, 3, 30, 149):
        total = 0.0
        for states, result in runs:
            off = states_of(result)[tick] - states[tick]
            total += off @ np.linalg.solve(result.covariance[tick], off)
        assert low < total < high


def test_trim_error_and_gyro_bias_are_found_beside_a_moving_torque() -> None:
    times = STEP * np.arange(3000)
    torque = 0.5 * np.sin(3 * times)
    # The true motion under the torque held from tick to tick and a trim error of 0.05 rad/s^2.
    rate = np.concatenate(([0.0], np.cumsum(STEP * (torque + 0.05))[:-1]))
    angle = np.concatenate(([0.0], np.cumsum(STEP * rate + STEP**2 / 2 * (torque + 0.05))[:-1]))
    quiet = {"torque_noise": 1e-3, "disturbance_wander": 1e-4, "bias_wander": 1e-5}
    result = estimate(angle, rate + 0.005, torque, parameters=quiet)
    assert result.disturbance[-1] == pytest.approx(0.05, abs=1e-4)
    assert result.bias[-1] == pytest.approx(0.005, abs=1e-4)
    assert result.angular_rate[-1] == pytest.approx(rate[-1], abs=1e-4)


def test_a_late_heading_is_held_against_the_heading_of_its_instant() -> None:
    # A steady turn at 0.5 rad/s; the camera tells 0.3 s late, ten times a second, between two ticks.
    times = STEP * np.arange(4000)
    angle, stamp = np.full(4000, np.nan), np.full(4000, np.nan)
    for k in range(30, 4000, 10):
        stamp[k : k + 10] = times[k] - 0.3042
        angle[k : k + 10] = np.angle(np.exp(1j * (0.2 + 0.5 * stamp[k])))
    result = estimate(angle, 0.5, 0.0, stamp=stamp)
    off = np.angle(np.exp(1j * (result.estimate - 0.2 - 0.5 * times)))
    assert np.abs(off[2000:]).max() < 1e-3
    assert np.abs(result.estimate).max() <= math.pi


def test_a_held_frame_counts_once() -> None:
    stamp = np.repeat(0.1 * np.arange(20), 10)
    angle = np.full(200, 0.1)
    held = estimate(angle, np.nan, 0.0, stamp=stamp)
    gone = estimate(np.where(np.arange(200) % 10 == 0, angle, np.nan), np.nan, 0.0, stamp=stamp)
    assert np.array_equal(held.estimate, gone.estimate)
    assert held.estimate[-1] == pytest.approx(0.1, abs=1e-3)


def test_a_missing_angle_leaves_the_gyro_and_a_missing_gyro_the_angle() -> None:
    times = STEP * np.arange(400)
    spun = estimate(np.where(times < 2, 0.1 * times, np.nan), 0.1, 0.0)
    assert spun.estimate[-1] == pytest.approx(0.1 * times[-1], abs=5e-3)
    still = estimate(0.3, np.full(400, np.nan), 0.0)
    assert still.estimate[-1] == pytest.approx(0.3, abs=1e-3)


def test_one_wrong_angle_moves_it_no_more_than_the_gate_allows() -> None:
    angle = np.zeros(500)
    angle[400] = 2.0
    result = estimate(angle, 0.0, np.zeros(500), parameters={"gate": 5.0})
    deviation = math.sqrt(result.covariance[399, 0, 0])
    assert 0.0 < np.abs(result.estimate[400:]).max() < 5 * deviation


def test_a_lasting_change_wins_over_the_gate() -> None:
    # At the start the angle is known to 0.05 rad: one of 0.3 rad looks wrong for as long as that is believed.
    result = estimate(np.full(4000, 0.3), np.zeros(4000), 0.0, parameters={"gate": 3.0})
    assert result.estimate[-1] == pytest.approx(0.3, abs=0.01)


def test_the_short_way_round_is_taken_at_half_a_turn() -> None:
    angle = np.where(np.arange(400) % 2 == 0, math.pi - 0.01, -math.pi + 0.01)
    result = estimate(angle, np.zeros(400), 0.0, parameters={"initial_sigma": (3.0, 0.05, 0.1, 0.01)})
    assert np.abs(np.angle(-np.exp(1j * result.estimate[50:]))).max() < 0.01
