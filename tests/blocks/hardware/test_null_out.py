"""Tests of the block hardware.null_out."""

from __future__ import annotations

import numpy as np

from quadvis.testing import drive
from quadvis_blocks.hardware.null_out import NullOut
from quadvis_blocks.hardware.sbus_out import SbusOut


def test_it_gives_what_it_was_given() -> None:
    commands = np.array([[0.1, -0.2], [0.3, 0.4]])
    np.testing.assert_array_equal(drive(NullOut(), command=commands).sent, commands)


def test_it_has_the_ports_of_the_device_that_it_stands_in_for() -> None:
    for mine, other in (
        (NullOut.interface.inputs, SbusOut.interface.inputs),
        (NullOut.interface.outputs, SbusOut.interface.outputs),
    ):
        assert {name: (port.type, port.unit) for name, port in mine.items()} == {
            name: (port.type, port.unit) for name, port in other.items()
        }
