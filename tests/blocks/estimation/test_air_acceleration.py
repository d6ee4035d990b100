"""The air by the accelerometer: the force across the axis of the craft."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis.testing import drive
from quadvis_blocks.estimation.air_acceleration import AirAcceleration

ANGLES = st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-3.1, 3.1))
QUICK = 1e-6  # s, of a lag that does not show


def felt(
    force: Any,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
    **more: Any,
) -> Any:
    return drive(
        AirAcceleration(**more),
        specific_force=force,
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        rate="100 Hz",
        steps=1,
    ).acceleration


@given(ANGLES, st.tuples(*[st.floats(-2.0, 2.0)] * 2), st.floats(-15.0, 0.0))
def test_it_is_the_force_across_the_axis_of_the_craft_in_level_axes(
    angles: Any, across: Any, along: float
) -> None:
    found = felt([*across, along], *angles, time_constant=QUICK)[0]
    expected = Rotation.from_euler("ZYX", angles[::-1]).apply([*across, 0.0])
    assert found == pytest.approx([*expected[:2], 0.0], abs=1e-12)


def test_it_follows_a_step_with_its_time_constant() -> None:
    found = drive(
        AirAcceleration(time_constant=0.2), specific_force=[0.3, 0.0, -9.81], roll=0.0, pitch=0.0, yaw=0.0,
        rate="100 Hz", steps=20,
    ).acceleration[:, 0]  # fmt: skip
    assert found[-1] == pytest.approx(0.3 * (1 - math.exp(-1.0)))
    assert (np.diff(found) > 0.0).all()


def test_an_accelerometer_that_fails_is_forgotten() -> None:
    force = np.tile([0.3, 0.0, -9.81], (100, 1))
    force[20:] = math.nan
    found = drive(
        AirAcceleration(),
        specific_force=force,
        roll=0.0,
        pitch=0.0,
        yaw=0.0,
        rate="100 Hz",
    ).acceleration
    assert found[19, 0] > 0.2
    assert np.isfinite(found).all() and abs(found[-1, 0]) < 1e-3
