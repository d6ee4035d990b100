import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.control.altitude import Altitude


def thrust(block: Altitude, **inputs: float) -> float:
    still = {"height": 1.0, "climb": 0.0, "roll": 0.0, "pitch": 0.0, "height_reference": 1.0}
    return float(drive(block, steps=1, **(still | inputs)).thrust[0])


def test_at_its_height_it_carries_the_weight() -> None:
    assert thrust(Altitude()) == pytest.approx(0.5 * 9.81)


def test_the_gains_follow_from_bandwidth_and_mass_as_a_force() -> None:
    # lambda 3, m 0.5: a1 = 3 N s/m, a2 = 4.5 N/m
    block = Altitude(bandwidth=3.0)
    assert thrust(block, climb=0.1) - thrust(block) == pytest.approx(-0.3)
    assert thrust(block, height=1.2) - thrust(block) == pytest.approx(-0.9)


def test_raw_gains_override_the_bandwidth() -> None:
    block = Altitude(gains=(1.5, 2.5))
    assert thrust(block, height=1.2, climb=0.1) - thrust(block) == pytest.approx(-0.15 - 0.5)


@given(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7), st.floats(-1, 1), st.floats(-1, 1))
def test_the_vertical_force_does_not_depend_on_the_tilt(
    roll: float, pitch: float, error: float, climb: float
) -> None:
    inputs = {"height": 1.0 + error, "climb": climb}
    lifted = thrust(Altitude(), **inputs, roll=roll, pitch=pitch) * math.cos(roll) * math.cos(pitch)
    assert lifted == pytest.approx(thrust(Altitude(), **inputs))


def test_beyond_the_tilt_floor_the_thrust_grows_no_more() -> None:
    assert thrust(Altitude(), roll=1.5) == pytest.approx(2 * 0.5 * 9.81)
    assert thrust(Altitude(), roll=3.0) == pytest.approx(2 * 0.5 * 9.81)


def test_the_force_is_limited_but_not_the_weight() -> None:
    assert thrust(Altitude(force_limit=1.0), height=-50.0) == pytest.approx(4.905 + 1.0)
    assert thrust(Altitude(force_limit=1.0), height=50.0) == pytest.approx(4.905 - 1.0)


def test_references_and_feedforward_shift_the_balance() -> None:
    assert thrust(Altitude(), climb=0.2, climb_reference=0.2) == pytest.approx(4.905)
    assert thrust(Altitude(), feedforward=0.3) == pytest.approx(4.905 + 0.3)


def test_one_gain_without_the_other_is_refused() -> None:
    with pytest.raises(ParameterError, match="gains must both be above 0, or both 0"):
        Altitude(gains=(1.0, 0.0))
