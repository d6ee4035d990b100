import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis.block import ParameterError
from quadvis.testing import Driven, drive
from quadvis_blocks.sensors.imu import Imu

QUIET = {"angle_noise": 0.0, "drift": 0.0, "rate_noise": 0.0, "force_noise": 0.0, "force_drift": 0.0}
ATTITUDE, RATES = np.array([0.1, -0.2, 3.0]), np.array([0.4, 0.5, -0.6])
DEGREE = math.pi / 180


def measure(steps: int = 1, **parameters: Any) -> Driven:
    return drive(Imu(**parameters), attitude=ATTITUDE, rates=RATES, rate="100 Hz", steps=steps)


def test_without_errors_it_gives_the_truth() -> None:
    result = measure(steps=3, **QUIET)
    assert result.roll.tolist() == [0.1] * 3 and result.pitch.tolist() == [-0.2] * 3
    assert np.array_equal(result.gyro, [RATES] * 3)


def test_biases_add_to_angles_and_rates() -> None:
    result = measure(**QUIET, angle_bias=(0.01, -0.02), rate_bias=(0.1, 0.2, 0.3))
    assert (result.roll[0], result.pitch[0]) == pytest.approx((0.11, -0.22))
    assert result.gyro[0] == pytest.approx(np.add(RATES, (0.1, 0.2, 0.3)))


def test_white_noise_has_its_deviation_on_each_channel_and_no_memory() -> None:
    result = measure(steps=2500, drift=0.0)
    errors = np.column_stack((result.roll - 0.1, result.pitch + 0.2, result.gyro - RATES))
    expected = np.array([0.1, 0.1, 0.5, 0.5, 0.5]) * DEGREE
    assert errors.std(axis=0) == pytest.approx(expected, rel=4 / math.sqrt(2 * 2500))
    assert np.abs(np.corrcoef(errors.T) - np.eye(5)).max() < 4 / 50
    assert abs(np.corrcoef(errors[1:, 0], errors[:-1, 0])[0, 1]) < 4 / 50


@pytest.mark.slow
def test_the_drift_has_its_deviation_and_correlation_time() -> None:
    result = measure(steps=10000, angle_noise=0.0, drift_time=0.2)
    drift = result.roll - 0.1
    samples = 100 / (2 * 0.2)
    assert drift.std() == pytest.approx(0.2 * DEGREE, rel=4 / math.sqrt(2 * samples))
    lagged = np.corrcoef(drift[20:], drift[:-20])[0, 1]
    assert lagged == pytest.approx(math.exp(-1.0), abs=4 / math.sqrt(samples))
    assert abs(np.corrcoef(result.roll, result.pitch)[0, 1]) < 4 / math.sqrt(samples)


def test_the_drift_is_there_from_the_first_sample() -> None:
    first = [measure(angle_noise=0.0, drift=1.0).roll[0] - 0.1]
    first += [
        drive(Imu(angle_noise=0.0, drift=1.0), attitude=ATTITUDE, rates=RATES, seed=seed, steps=1).roll[0]
        - 0.1
        for seed in range(1, 300)
    ]
    assert np.std(first) == pytest.approx(1.0, rel=4 / math.sqrt(600))


@pytest.mark.slow
def test_the_rates_drift_apart_from_each_other_and_from_the_angles() -> None:
    quiet = QUIET | {"drift": 0.1, "drift_time": 0.2}
    result = measure(steps=10000, **quiet, rate_drift=0.02)
    drift = result.gyro - RATES
    samples = 100 / (2 * 0.2)
    assert drift.std(axis=0) == pytest.approx([0.02] * 3, rel=4 / math.sqrt(2 * samples))
    lagged = [np.corrcoef(channel[20:], channel[:-20])[0, 1] for channel in drift.T]
    assert lagged == pytest.approx([math.exp(-1.0)] * 3, abs=4 / math.sqrt(samples))
    together = np.corrcoef(np.column_stack((drift, result.roll, result.pitch)).T)
    assert np.abs(together - np.eye(5)).max() < 4 / math.sqrt(samples)


def test_the_drift_of_the_rates_leaves_all_other_errors_as_they_are() -> None:
    calm, drifting = measure(steps=20), measure(steps=20, rate_drift=0.1)
    assert np.array_equal(calm.roll, drifting.roll) and np.array_equal(calm.pitch, drifting.pitch)
    assert (calm.gyro != drifting.gyro).all()


SIZES = {"angle_bias": (0.01, 0.02), "rate_bias": (0.1, 0.2, 0.3)}


def signed_biases(seed: int, **parameters: Any) -> list[float]:
    block = Imu(**(QUIET | SIZES | {"bias_sign": "random"} | parameters))
    result = drive(block, attitude=ATTITUDE, rates=RATES, rate="100 Hz", steps=3, seed=seed)
    errors = np.column_stack((result.roll - 0.1, result.pitch + 0.2, result.gyro - RATES))
    assert errors[0] == pytest.approx(errors[2], abs=1e-15)  # for the whole run
    return errors[0].tolist()


@pytest.mark.slow
def test_biases_of_random_sign_have_their_size_and_every_pattern_of_signs_comes() -> None:
    found = np.array([signed_biases(seed) for seed in range(300)])
    assert np.abs(found) == pytest.approx(np.tile([0.01, 0.02, 0.1, 0.2, 0.3], (300, 1)))
    signs = np.sign(found)
    assert np.abs(signs.mean(axis=0)).max() < 4 / math.sqrt(300)
    assert np.abs(np.corrcoef(signs.T) - np.eye(5)).max() < 4 / math.sqrt(300)
    assert len({tuple(row) for row in signs}) == 32


def test_random_signs_leave_the_noise_as_it_is() -> None:
    noisy = {"angle_noise": 0.1, "rate_noise": 0.2, "drift": 0.3}
    block, plain = Imu(**noisy, **SIZES, bias_sign="random"), Imu(**noisy)
    one, other = (drive(b, attitude=ATTITUDE, rates=RATES, rate="100 Hz", steps=50) for b in (block, plain))
    assert np.ptp(one.roll - other.roll) < 1e-12 and np.ptp(one.gyro - other.gyro, axis=0).max() < 1e-12


def test_yaw_is_not_measured_and_the_stamp_is_the_instant() -> None:
    assert list(Imu.interface.outputs) == ["roll", "pitch", "gyro", "specific_force", "stamp"]
    assert measure(steps=3).stamp == pytest.approx([0.0, 0.01, 0.02])


def test_a_negative_noise_is_refused() -> None:
    with pytest.raises(ParameterError, match="rate_noise must be at least 0 rad/s, got -1 rad/s"):
        Imu(rate_noise=-1.0)


def sine(**parameters: Any) -> Driven:
    time = np.arange(60) / 100
    wave = np.sin(3.0 * time)
    attitude = np.column_stack((wave, 0.5 * wave, 0.0 * wave))
    return drive(Imu(**QUIET, **parameters), attitude=attitude, rates=2.0 * attitude, rate="100 Hz")


@pytest.mark.parametrize("delay", [0.004, 0.01, 0.03, 0.0425])
def test_a_delay_gives_what_was_measured_before(delay: float) -> None:
    result = sine(delay=delay)
    time = np.arange(60) / 100
    then = np.sin(3.0 * (time - delay))[6:]
    assert result.roll[6:] == pytest.approx(then, abs=9 * 0.01**2 / 8)  # of straight lines between ticks
    assert result.gyro[6:, 1] == pytest.approx(then, abs=9 * 0.01**2 / 8)
    assert result.stamp == pytest.approx(time - delay)
    assert result.roll[0] == 0.0


def test_a_delay_of_whole_ticks_gives_the_samples_themselves() -> None:
    assert np.array_equal(sine(delay=0.03).roll[3:], sine().roll[:-3])


def test_a_delay_that_holds_too_many_samples_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"at most 128 ticks of the block, 1\.28 s, got 2 s"):
        sine(delay=2.0)


def test_the_scale_multiplies_angles_and_rates_but_not_their_errors() -> None:
    result = measure(**QUIET, scale=1.2, angle_bias=(0.01, 0.0))
    assert (result.roll[0], result.pitch[0]) == pytest.approx((0.13, -0.24))
    assert result.gyro[0] == pytest.approx(1.2 * RATES)


small = st.floats(-0.3, 0.3)


@given(st.tuples(small, small, small), st.tuples(small, small, st.floats(-3.0, 3.0)))
def test_a_misaligned_unit_measures_about_its_own_axes(mount: Any, attitude: Any) -> None:
    result = drive(Imu(**QUIET, misalignment=mount), attitude=np.array(attitude), rates=RATES, steps=1)
    craft, unit = (Rotation.from_euler("ZYX", angles[::-1]) for angles in (attitude, mount))
    _, pitch, roll = (craft * unit).as_euler("ZYX")
    assert (result.roll[0], result.pitch[0]) == pytest.approx((roll, pitch), abs=1e-9)
    assert result.gyro[0] == pytest.approx(unit.inv().apply(RATES), abs=1e-12)


def forces(steps: int = 200, **parameters: Any) -> np.ndarray:
    """Specific forces of a craft that turns and is accelerated by (1, 2, 3) m/s^2 along x, y, h."""
    times = 0.01 * np.arange(steps)[:, None]
    attitude = np.array([0.1, -0.2, 3.0]) + times * np.array([0.2, -0.1, 0.5])
    attitude[:, 2] = np.remainder(attitude[:, 2] + math.pi, 2 * math.pi) - math.pi
    result = drive(
        Imu(**parameters), attitude=attitude, rates=RATES, velocity=times * (1.0, 2.0, 3.0), rate="100 Hz"
    )
    return np.asarray(result.specific_force)


def test_the_specific_force_is_the_acceleration_without_gravity_in_axes_of_the_craft() -> None:
    found = forces(**QUIET)
    middles = np.array([0.1, -0.2, 3.0]) + (0.01 * np.arange(1, 200) - 0.005)[:, None] * (0.2, -0.1, 0.5)
    turns = Rotation.from_euler("ZYX", middles[:, ::-1])
    assert found[1:] == pytest.approx(turns.inv().apply([1.0, 2.0, -3.0 - 9.81]), abs=1e-9)


def test_a_craft_begins_at_rest_and_without_its_velocity_no_force_is_known() -> None:
    first = forces(steps=1, **QUIET)[0]
    start = Rotation.from_euler("ZYX", [3.0, -0.2, 0.1])
    assert first == pytest.approx(start.inv().apply([0.0, 0.0, -9.81]))
    assert np.isnan(measure(**QUIET).specific_force).all()


@pytest.mark.slow
def test_scale_delay_and_errors_reach_the_force_too() -> None:
    plain, bias = forces(**QUIET), np.array([0.1, -0.2, 0.3])
    assert forces(**QUIET, scale=1.3) == pytest.approx(1.3 * plain)
    assert forces(**QUIET, delay=0.04)[10:] == pytest.approx(plain[6:-4])
    assert forces(**QUIET, force_bias=tuple(bias)) == pytest.approx(plain + bias)
    noise = forces(steps=2500, **{**QUIET, "force_noise": 0.1}) - forces(steps=2500, **QUIET)
    assert noise.std(axis=0) == pytest.approx(np.full(3, 0.1), rel=4 / math.sqrt(2 * 2500))


def test_signs_of_the_biases_of_the_force_leave_those_of_the_others_alone() -> None:
    signs = {"bias_sign": "random", "rate_bias": (0.1, 0.1, 0.1), "angle_bias": (0.1, 0.1)}
    plain = measure(**QUIET, **signs)
    found = measure(**QUIET, **signs, force_bias=(0.5, 0.5, 0.5))
    assert np.array_equal(plain.gyro, found.gyro) and np.array_equal(plain.roll, found.roll)
    turned = forces(steps=2, **QUIET, bias_sign="random", force_bias=(0.5, 0.5, 0.5)) - forces(
        steps=2, **QUIET
    )
    assert np.abs(turned) == pytest.approx(np.full((2, 3), 0.5))
