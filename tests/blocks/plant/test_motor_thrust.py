import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks._thrust_curve import command_for, thrust_share
from quadvis_blocks.plant.motor_thrust import MotorThrust

shares = st.floats(0.0, 1.0)


def px4(thrust: float, factor: float) -> float:
    """Return the command for a thrust as PX4 computes it with its parameter THR_MDL_FAC above 0."""
    share = (1.0 - factor) / (2.0 * factor)
    return -share + math.sqrt(share * share + thrust / factor)


@given(shares, st.floats(0.05, 1.0))
def test_the_curve_is_that_of_px4(thrust: float, factor: float) -> None:
    assert command_for(thrust, factor) == pytest.approx(px4(thrust, factor), abs=1e-9)


@given(shares, shares)
def test_the_curve_goes_back_and_forth(share: float, curve: float) -> None:
    assert thrust_share(command_for(share, curve), curve) == pytest.approx(share, abs=1e-7)


def test_a_speed_that_follows_the_command_gives_its_square() -> None:
    found = drive(MotorThrust(thrust_max=3.0), steps=1, command=[0.5] * 4).thrust[0]
    assert found == pytest.approx(np.full(4, 0.75))
    found = drive(MotorThrust(thrust_max=3.0, curve=0.0), steps=1, command=[0.5] * 4).thrust[0]
    assert found == pytest.approx(np.full(4, 1.5))


def test_motors_rear_right_left_front_are_rotors_front_right_rear_left() -> None:
    command = [0.1, 0.2, 0.3, 0.4]  # of motors 1 to 4 of Betaflight's QUADP
    found = drive(MotorThrust(thrust_max=1.0, curve=0.0), steps=1, command=command).thrust[0]
    assert found == pytest.approx([0.4, 0.2, 0.1, 0.3])


@pytest.mark.parametrize(("command", "thrust"), [(-3.0, 0.0), (7.0, 2.0)])
def test_a_command_beyond_its_range_stays_at_its_end(command: float, thrust: float) -> None:
    assert drive(MotorThrust(), steps=1, command=[command] * 4).thrust[0] == pytest.approx(np.full(4, thrust))


def test_a_motor_that_turns_two_rotors_is_refused() -> None:
    with pytest.raises(ParameterError, match="order must name each motor once"):
        MotorThrust(order=(1, 2, 3, 3))
