"""Attitudes that bring a craft to its place: signs by the equations of motion, limits, thrust."""

from __future__ import annotations

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.control.attitude_setpoint import AttitudeSetpoint
from quadvis_blocks.plant.rotorcraft import Rotorcraft

REST = {"forward": 0.0, "right": 0.0, "forward_velocity": 0.0, "right_velocity": 0.0, "heading": 0.0}


def command(**given: float) -> list[float]:
    values = {name: [value] for name, value in {**REST, "collective": 4.0, **given}.items()}
    found: list[float] = drive(AttitudeSetpoint(bandwidth=2.0), rate="20 Hz", **values).command[-1].tolist()
    return found


def test_at_its_place_a_craft_is_level() -> None:
    assert command() == [0.0, 0.0, 0.0, 0.5]
    assert command(heading=1.5, collective=12.0) == [0.0, 0.0, 1.5, 1.0]


@pytest.mark.parametrize(("axis", "index", "place"), [("forward", 1, 0), ("right", 0, 1)])
def test_the_attitude_accelerates_a_craft_back_by_the_law_that_was_asked_for(
    axis: str, index: int, place: int
) -> None:
    tilt = command(**{axis: 0.05, f"{axis}_velocity": 0.02})[index]
    attitude = [0.0, 0.0, 0.0]
    attitude[index] = tilt
    craft = Rotorcraft(model="rigid_body", initial_attitude=attitude, drag=0.0)
    hover = np.full(4, 0.25 * craft.mass * craft.gravity)
    moved = drive(craft, rate="1000 Hz", steps=11, thrust=hover).velocity[-1]
    wanted = -(2 * 2.0 * 0.02 + 2.0**2 * 0.05)
    assert moved[place] / 0.01 == pytest.approx(wanted, rel=1e-3)


def test_the_tilt_has_a_limit() -> None:
    assert command(forward=100.0, right=100.0)[:2] == [-0.2, 0.2]
