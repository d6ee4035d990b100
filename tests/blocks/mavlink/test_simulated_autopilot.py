"""The model of an autopilot has the outputs of the device, and arms after its delay."""

from __future__ import annotations

import math

import numpy as np

from quadvis.testing import drive
from quadvis_blocks.mavlink._arming import ARM, DONE, IDLE
from quadvis_blocks.mavlink.autopilot import Autopilot
from quadvis_blocks.mavlink.simulated_autopilot import SimulatedAutopilot

MOTION = {"attitude": [0.1, 0.2, 0.3], "body_rates": [0.01, 0.02, 0.03]}


def test_its_outputs_are_those_of_the_device() -> None:
    def described(block: type) -> dict[str, tuple[str, str, bool]]:
        return {name: (port.type, port.unit, port.nan) for name, port in block.interface.outputs.items()}  # type: ignore[attr-defined]

    assert described(SimulatedAutopilot) == described(Autopilot)


def test_it_says_what_is_and_nothing_of_what_is_not_connected() -> None:
    found = drive(SimulatedAutopilot(mode_number=4), rate="100 Hz", steps=2, **MOTION)
    assert (found.roll[-1], found.pitch[-1], found.yaw[-1]) == (0.1, 0.2, 0.3)
    assert found.rates[-1].tolist() == [0.01, 0.02, 0.03] and found.valid[-1] and found.mode[-1] == 4
    assert math.isnan(found.imu_age[-1]) and np.isnan(found.gyro[-1]).all()
    assert math.isnan(found.position_age[-1]) and np.isnan(found.position[-1]).all()
    more = drive(
        SimulatedAutopilot(),
        rate="100 Hz",
        steps=2,
        force=[0.0, 0.0, -9.8],
        place=[1.0, 2.0, 3.0],
        motion=[0.1, 0.2, 0.3],
        **MOTION,
    )
    assert (more.imu_age[-1], more.position_age[-1], more.age[-1]) == (0.0, 0.0, 0.0)
    assert more.gyro[-1].tolist() == [0.01, 0.02, 0.03] and more.position[-1].tolist() == [1.0, 2.0, 3.0]


def test_it_is_armed_and_disarmed_after_its_delay() -> None:
    arm = [False, *[True] * 5, *[False] * 5]
    found = drive(SimulatedAutopilot(delay=0.03), rate="100 Hz", arm=arm, **MOTION)
    assert found.armed.tolist() == [*[False] * 5, True, *[True] * 4, False]
    assert found.arming.tolist() == [IDLE, *[ARM] * 4, DONE, *[ARM] * 4, IDLE]
