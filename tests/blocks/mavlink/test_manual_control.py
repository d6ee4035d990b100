"""Sticks of a joystick: what pymavlink reads, and their signs."""

from __future__ import annotations

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.mavlink.manual_control import ManualControl
from tests.blocks.mavlink.pymavlink_peer import received

ENDS = {"initial": [0.0, 0.0, 0.0, 0.0], "safe": [0.0, 0.0, 0.0, 0.4]}


def device() -> ManualControl:
    return ManualControl(port="udp:127.0.0.1:14550", own_system=255, own_component=190, **ENDS)


def test_sticks_arrive_with_forward_and_right_as_positive() -> None:
    block = device()
    found = received(block, block.frame(np.array([0.25, 0.5, 0.75, 1.0])))
    assert found.get_type() == "MANUAL_CONTROL" and found.target == 1
    assert (found.x, found.y, found.r, found.z) == (-500, 250, 750, 1000)


def test_what_goes_beyond_the_ends_stays_there() -> None:
    sent = drive(device(), command=[[-2.0, 2.0, 0.12345, -1.0]]).sent
    assert sent[-1].tolist() == [-1.0, 1.0, 0.123, 0.0]


def test_the_release_has_axes_that_say_nothing() -> None:
    block = device()
    found = received(block, block.ending())
    assert (found.x, found.y, found.z, found.r) == (0x7FFF,) * 4


def test_ends_beyond_those_of_the_sticks_are_refused() -> None:
    words = "safe must lie between -1 and 1, and its throttle between 0 and 1"
    with pytest.raises(ParameterError, match=words):
        ManualControl(port="udp:127.0.0.1:14550", **{**ENDS, "safe": [0.0, 0.0, 0.0, -0.1]})
    with pytest.raises(ValueError, match="a command must be finite"):
        device().frame(np.array([np.nan, 0.0, 0.0, 0.5]))
