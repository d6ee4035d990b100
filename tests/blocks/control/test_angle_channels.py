import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.control.angle_channels import AngleChannels
from quadvis_blocks.plant.motor_thrust import MotorThrust

NOTHING = {"collective": 4.9, "roll": 0.0, "pitch": 0.0, "yaw_rate": 0.0}
WEIGHT = 0.5 * 9.81


def once(block: AngleChannels, **inputs: Any) -> Any:
    return drive(block, steps=1, **{**NOTHING, **inputs})


def pulses(block: AngleChannels | None = None, **inputs: Any) -> Any:
    """Return the channels in us."""
    return 1e6 * once(block or AngleChannels(), **inputs).channels[0]


@pytest.mark.parametrize(
    ("inputs", "channel", "pulse"),
    [
        ({"roll": math.radians(15)}, 0, 1750),  # right side down: long
        ({"pitch": math.radians(15)}, 1, 1250),  # nose up: short
        ({"yaw_rate": math.radians(-100)}, 3, 1250),  # counterclockwise: short
        ({"roll": 9.0}, 0, 2000),
        ({"pitch": 9.0}, 1, 1000),
        ({}, 0, 1500),
        ({}, 4, 2000),
        ({"arm": False}, 4, 1000),
        ({"collective": -1.0}, 2, 1050),
        ({"collective": 8.0}, 2, 2000),
        ({"collective": 80.0}, 2, 2000),
    ],
)
def test_each_stick_goes_the_way_of_its_angle(inputs: dict[str, Any], channel: int, pulse: float) -> None:
    assert pulses(**inputs)[channel] == pytest.approx(pulse)


@given(st.floats(0.0, 8.0), st.floats(0.0, 1.0), st.floats(0.0, 0.2))
def test_the_motors_give_the_collective_that_the_stick_was_moved_for(
    collective: float, curve: float, idle_command: float
) -> None:
    """Betaflight makes of the throttle a command from that of idle to full; the motors make thrust of it."""
    found = once(AngleChannels(curve=curve, idle_command=idle_command), collective=collective)
    stick = (1e6 * found.channels[0, 2] - 1050) / 950
    command = idle_command + (1 - idle_command) * stick
    lift = drive(MotorThrust(curve=curve), steps=1, command=[command] * 4).thrust[0].sum()
    assert found.given[0] == pytest.approx([lift, 0, 0, 0], abs=1e-9)
    assert found.thrust[0] == pytest.approx([lift / 4] * 4, abs=1e-9)
    least = drive(MotorThrust(curve=curve), steps=1, command=[idle_command] * 4).thrust[0].sum()
    assert lift == pytest.approx(max(collective, least), abs=1e-6)


def test_on_the_ground_the_sticks_are_in_the_middle_and_the_ground_carries_the_weight() -> None:
    found = once(AngleChannels(), collective=6.0, roll=0.2, pitch=0.1, yaw_rate=1.0, idle=True)
    assert 1e6 * found.channels[0] == pytest.approx([1500, 1500, 1000, 1500, 2000])
    assert found.given[0] == pytest.approx([WEIGHT, 0, 0, 0])
    assert found.thrust[0] == pytest.approx(np.full(4, WEIGHT / 4))


def test_a_craft_that_its_motors_cannot_carry_is_refused() -> None:
    with pytest.raises(ParameterError, match="thrust_max must be above a quarter of the weight"):
        AngleChannels(thrust_max=1.0)
