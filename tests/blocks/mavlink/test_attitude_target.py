"""Attitudes as set-points: what pymavlink reads, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.quaternion import QuaternionBase

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks._angles import rotation
from quadvis_blocks.mavlink.attitude_target import AttitudeTarget
from tests.blocks.mavlink.pymavlink_peer import received

ANGLE = st.floats(-1.5, 1.5)


def device(**given: Any) -> AttitudeTarget:
    ends = {"initial": [0.0, 0.0, 0.0, 0.0], "safe": [0.0, 0.0, 0.0, 0.4]}
    return AttitudeTarget(**{"port": "udp:127.0.0.1:14550", **ends, **given})


@given(ANGLE, ANGLE, st.floats(-3.1, 3.1), st.floats(0.0, 1.0))
def test_angles_and_thrust_arrive_as_they_are(roll: float, pitch: float, yaw: float, thrust: float) -> None:
    block = device(target_system=7, target_component=3)
    found = received(block, block.frame(np.array([roll, pitch, yaw, thrust])))
    assert (found.get_type(), found.target_system, found.target_component) == ("SET_ATTITUDE_TARGET", 7, 3)
    assert found.type_mask == 0b111  # the rates are to be ignored
    assert found.thrust == pytest.approx(thrust, abs=1e-6)
    turned = np.array(QuaternionBase(found.q).dcm)
    assert turned == pytest.approx(rotation(roll, pitch, yaw), abs=1e-5)


def test_the_thrust_stays_between_its_ends() -> None:
    sent = drive(device(), command=[[0.1, 0.2, 0.3, 1.5], [0.1, 0.2, 0.3, -0.5]]).sent
    assert sent.tolist() == [[0.1, 0.2, 0.3, 1.0], [0.1, 0.2, 0.3, 0.0]]


def test_the_release_is_a_message_in_which_all_is_to_be_ignored() -> None:
    block = device()
    found = received(block, block.ending())
    assert found.type_mask == 0b11000111


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"safe": [0.0, 0.0, 0.0, 1.5]}, "the last number of safe is a thrust, and must lie between 0 and 1"),
        ({"initial": [0.0, 0.0, 0.0, -0.5]}, "the last number of initial is a thrust, and must lie between"),
        ({"spacing": 1.0}, "spacing must be at most 0.4 s, got 1 s"),
        ({"dialect": "comon"}, "dialect 'comon' is not one of pymavlink's; did you mean 'common'"),
        ({"dialect": "minimal"}, "dialect 'minimal' has no message SET_ATTITUDE_TARGET"),
        ({"key": "../secret"}, "key must be the name of a key, got '../secret'"),
        ({"port": "/dev/x", "baud": 1200}, "send fewer frames, or use a faster line"),
    ],
)
def test_what_cannot_be_sent_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words.replace(".", r"\.")):
        device(**given)


def test_a_command_that_is_missing_is_an_error() -> None:
    with pytest.raises(ValueError, match="a command must be finite"):
        device().frame(np.array([np.nan, 0.0, 0.0, 0.5]))
