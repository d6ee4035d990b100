"""Body rates as set-points: what pymavlink reads."""

from __future__ import annotations

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.mavlink.rate_target import RateTarget
from tests.blocks.mavlink.pymavlink_peer import received

ENDS = {"initial": [0.0, 0.0, 0.0, 0.0], "safe": [0.0, 0.0, 0.0, 0.4]}


def test_rates_and_thrust_arrive_as_they_are() -> None:
    block = RateTarget(port="udp:127.0.0.1:14550", **ENDS)
    found = received(block, block.frame(np.array([0.1, -0.2, 0.3, 0.5])))
    assert found.get_type() == "SET_ATTITUDE_TARGET" and found.type_mask == 0b10000000
    rates = [found.body_roll_rate, found.body_pitch_rate, found.body_yaw_rate, found.thrust]
    assert rates == pytest.approx([0.1, -0.2, 0.3, 0.5])
    assert drive(block, command=[[0.1, -0.2, 0.3, 2.0]]).sent[-1].tolist() == [0.1, -0.2, 0.3, 1.0]
    assert received(block, block.ending()).type_mask == 0b11000111


def test_a_thrust_beyond_its_ends_is_refused() -> None:
    with pytest.raises(ParameterError, match="the last number of safe is a thrust"):
        RateTarget(port="udp:127.0.0.1:14550", **{**ENDS, "safe": [0.0, 0.0, 0.0, -1.0]})
