import math

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.plant.lateral import Lateral


def test_a_constant_torque_goes_through_four_integrators() -> None:
    result = drive(Lateral(gravity=9.0), torque=0.8, rate="10 Hz", steps=21)
    t = result.time
    assert result.angular_rate == pytest.approx(0.8 * t, abs=1e-12)
    assert result.angle == pytest.approx(0.4 * t**2, abs=1e-12)
    assert result.velocity == pytest.approx(9.0 * 0.8 * t**3 / 6, abs=1e-12)
    assert result.position == pytest.approx(9.0 * 0.8 * t**4 / 24, abs=1e-12)


def test_for_pitch_nose_up_goes_back() -> None:
    result = drive(Lateral(axis="pitch", initial_angle=0.1), torque=0.0, rate="10 Hz", steps=11)
    assert result.position[-1] == pytest.approx(-0.5 * 9.81 * 0.1)


def test_the_tangent_takes_the_place_of_the_angle() -> None:
    result = drive(Lateral(tilt="tangent", initial_angle=0.5), torque=0.0, rate="10 Hz", steps=11)
    assert result.velocity[-1] == pytest.approx(9.81 * math.tan(0.5))


def test_a_disturbance_is_an_acceleration_and_initial_values_count() -> None:
    block = Lateral(initial_position=1.0, initial_velocity=2.0, initial_rate=0.0)
    result = drive(block, torque=0.0, acceleration=0.4, rate="10 Hz", steps=11)
    assert result.position[-1] == pytest.approx(1.0 + 2.0 + 0.2)


def test_with_a_lag_the_torque_comes_like_that_of_a_motor() -> None:
    result = drive(Lateral(lag=0.08), torque=0.5, rate="200 Hz", steps=101)
    t = result.time
    assert result.angular_rate == pytest.approx(0.5 * (t - 0.08 * -np.expm1(-t / 0.08)), abs=1e-8)


def test_an_unknown_axis_is_refused() -> None:
    with pytest.raises(ParameterError, match="axis must be one of roll, pitch, got 'yaw'"):
        Lateral(axis="yaw")
