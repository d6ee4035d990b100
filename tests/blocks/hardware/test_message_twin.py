"""Tests of the block hardware.message_twin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.hardware.message_in import MessageIn
from quadvis_blocks.hardware.message_twin import MessageTwin

LAB = str(Path(__file__).parents[3] / "diagrams" / "protocols" / "lab_imu.yaml")


def test_it_has_the_outputs_of_the_device_that_it_stands_in_for() -> None:
    twin, device = MessageTwin(protocol=LAB), MessageIn(port="pty:imu", protocol=LAB)
    for one, other in ((twin, device),):
        assert [(name, port.type, port.unit, port.nan) for name, port in one.interface.outputs.items()] == [
            (name, port.type, port.unit, port.nan) for name, port in other.interface.outputs.items()
        ]
    assert [*twin.interface.inputs] == ["true_roll", "true_pitch", "true_rates"]


def test_values_are_rounded_and_limited_as_the_protocol_does() -> None:
    found = drive(
        MessageTwin(protocol=LAB),
        true_roll=[0.12345678, 9.0],
        true_pitch=[-0.1, -9.0],
        true_rates=[[1e-7, 2.0, -3.0], [50.0, 0.0, -50.0]],
    )
    assert found.roll.tolist() == [0.123457, 3.2]
    assert found.pitch.tolist() == [-0.1, -1.6]
    np.testing.assert_array_equal(found.rates, [[0.0, 2.0, -3.0], [40.0, 0.0, -40.0]])
    assert (found.age.tolist(), found.lost.tolist(), found.starting.tolist()) == ([0, 0], [0, 0], [False] * 2)


def test_a_format_does_the_same() -> None:
    twin = MessageTwin(format="<h", names="angle", units="deg", checksum="none")
    assert drive(twin, true_angle=[0.1, 9.9]).angle == pytest.approx(np.radians([6.0, 567.0]))
