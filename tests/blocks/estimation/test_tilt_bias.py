import math

import numpy as np
import pytest

from quadvis.testing import Driven, drive
from quadvis_blocks.estimation.tilt_bias import TiltBias

DEGREE = math.pi / 180
RATE = "10 Hz"


def watch(imu: object, pose: object, stamp: object, time_constant: float = 10.0, **more: object) -> Driven:
    """The block with the same angles for pitch, turned round."""
    turned = {"imu_pitch": -np.asarray(imu), "pitch": -np.asarray(pose)}
    block = TiltBias(time_constant=time_constant)
    return drive(block, imu_roll=imu, roll=pose, **turned, stamp=stamp, rate=RATE, **more)


def test_noisy_tilts_of_independent_poses_average_to_the_bias() -> None:
    rng = np.random.default_rng(1)
    times = 0.1 * np.arange(6000)
    tilt = 2 * DEGREE * np.sin(times)
    pose = tilt + 0.7 * DEGREE * rng.normal(size=6000)
    result = watch(tilt + 0.5 * DEGREE, pose, times)
    late = result.roll_bias[1000:]
    # A first-order average of white noise: variance T / (2 tau), independent every 2 tau.
    deviation = 0.7 * DEGREE * math.sqrt(0.1 / 20)
    assert late.mean() == pytest.approx(0.5 * DEGREE, abs=4 * deviation / math.sqrt(500 / 20))
    assert late.std() == pytest.approx(deviation, rel=4 / math.sqrt(2 * 500 / 20))
    assert np.array_equal(result.pitch_bias, -result.roll_bias)


def test_the_first_frames_count_as_in_a_mean() -> None:
    pose = np.array([0.01, 0.03, 0.05, -0.01, 0.0])
    bias = watch(0.0, pose, 0.1 * np.arange(5)).roll_bias
    assert bias[1:] == pytest.approx(-np.cumsum(pose)[:4] / [1, 2, 3, 4])


def test_with_a_pose_that_weighs_its_angles_it_is_a_kalman_filter() -> None:
    # A bias that wanders, a tilt of 0 seen by the camera with noise. The pose is the mean of the picture and
    # of the unit's angle less the bias so far, by variances; tilt_sigma is that of the stationary filter.
    rng = np.random.default_rng(2)
    wander, noise, count = 0.02, 0.7, 3000
    prior = (wander**2 + math.sqrt(wander**4 + 4 * wander**2 * noise**2)) / 2
    gain = prior / (prior + noise**2)
    truth = np.cumsum(wander * rng.normal(size=count))
    picture = noise * rng.normal(size=count)
    expected, found, pose = 0.0, np.zeros(count), np.zeros(count)
    for k in range(count):
        found[k] = expected
        pose[k] = (1 - gain) * (truth[k] - expected) + gain * picture[k]
        expected += gain * (truth[k] - picture[k] - expected)
    result = watch(truth * 1e-3, pose * 1e-3, 0.1 * np.arange(count), time_constant=0.0)
    assert result.roll_bias == pytest.approx(found * 1e-3, abs=1e-12)
    assert np.var(found[500:] - truth[500:]) == pytest.approx(prior, rel=0.25)


def test_a_frame_counts_once_and_only_if_its_pose_is_good() -> None:
    stamp = [0.0, 0.0, 0.0, 0.3, 0.4, np.nan, 0.6]
    pose = [0.01, 0.05, 0.05, np.nan, 0.5, 0.02, 0.03]
    valid = [True, True, True, True, True, True, False]
    bias = watch(0.0, np.array(pose), np.array(stamp), valid=valid).roll_bias
    assert bias.tolist() == [0.0] + [-0.01] * 6


def test_the_bias_does_not_depend_on_the_frame_of_now() -> None:
    assert TiltBias.interface.feedthrough == frozenset()
