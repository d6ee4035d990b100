import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis_blocks.control.trim import Trim
from quadvis_blocks.estimation.thrust_acceleration import ThrustAcceleration

wind = st.floats(-0.4, 0.4)


@given(wind, wind, wind, st.floats(-3.1, 3.1))
def test_tilt_and_force_balance_the_disturbance_at_any_heading(
    x: float, y: float, h: float, heading: float
) -> None:
    trim = drive(Trim(), acceleration=[x, y, h], heading=heading, steps=1)
    roll, pitch = float(trim.roll[0]), float(trim.pitch[0])
    collective = (0.5 * 9.81 + float(trim.force[0])) / (math.cos(roll) * math.cos(pitch))
    by_thrust = drive(
        ThrustAcceleration(), collective=collective, roll=roll, pitch=pitch, yaw=heading, steps=1
    ).acceleration[0]
    assert by_thrust[2] == pytest.approx(-h, abs=1e-12)
    # Roll and pitch share the lift: a product of three small numbers.
    assert by_thrust[:2] == pytest.approx([-x, -y], abs=1.1 * 0.4 * 0.4**2 / 9.4**2)


def test_angles_are_those_of_the_closed_form() -> None:
    trim = drive(Trim(), acceleration=[0.3, 0.2, 0.1], steps=1)
    assert trim.roll[0] == pytest.approx(-math.atan(0.2 / 9.71))
    assert trim.pitch[0] == pytest.approx(math.atan(0.3 / 9.71))
    assert trim.force[0] == pytest.approx(-0.05)


def test_no_estimate_leans_the_craft_beyond_the_limit() -> None:
    trim = drive(Trim(tilt_limit=0.05), acceleration=np.array([50.0, -50.0, 0.0]), steps=1)
    assert (trim.roll[0], trim.pitch[0]) == (0.05, 0.05)


def test_the_thrust_is_taken_to_carry_half_of_the_weight_at_least() -> None:
    trim = drive(Trim(), acceleration=[0.3, 0.0, 9.81], steps=1)
    assert trim.pitch[0] == pytest.approx(math.atan(0.3 / (0.5 * 9.81)))
