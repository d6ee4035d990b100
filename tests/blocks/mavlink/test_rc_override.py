"""Channels in the place of a receiver's: what pymavlink reads, and how they are given back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.mavlink.rc_override import RcOverride
from tests.blocks.mavlink.pymavlink_peer import received


def device(**given: Any) -> RcOverride:
    ends = {"initial": [0.0, 0.0, 0.0], "safe": [0.0, 0.0, 0.0]}
    values = {"channels": [1, 3, 10], "lowest": [-1.0, 0.0, 1.0], "highest": [1.0, 1.0, -1.0]}
    return RcOverride(**{"port": "udp:127.0.0.1:14550", **values, **ends, **given})


def channels(found: Any) -> list[int]:
    return [getattr(found, f"chan{number}_raw") for number in range(1, 19)]


def test_each_command_has_its_channel_and_all_others_stay_the_receivers() -> None:
    block = device()
    found = received(block, block.frame(np.array([0.5, 0.25, 0.5])))
    assert (found.get_type(), found.target_system, found.target_component) == ("RC_CHANNELS_OVERRIDE", 1, 1)
    assert channels(found) == [1750, 65535, 1250, *[65535] * 5, 0, 1250, *[0] * 8]


def test_the_release_gives_the_channels_back() -> None:
    block = device()
    assert channels(received(block, block.ending())) == [0, 65535, 0, *[65535] * 5, 0, 65534, *[0] * 8]


def test_sent_is_the_command_as_it_arrives() -> None:
    sent = drive(device(), command=[[0.1234567, 5.0, -5.0]]).sent[-1]
    assert sent == pytest.approx([0.124, 1.0, -1.0])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"channels": [1, 1, 2]}, "channels must be different from each other"),
        ({"channels": [1, 2, 19]}, "channels must be at most 18, got 19"),
        ({"safe": [0.0, 2.0, 0.0]}, "safe must lie between lowest and highest, element by element"),
    ],
)
def test_wrong_channels_and_ends_are_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        device(**given)
