"""Tests of the block hardware.msp_rc_out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive, drive_output
from quadvis_blocks.hardware._msp import SET_RAW_RC, V1
from quadvis_blocks.hardware.msp_rc_out import MspRcOut
from tests.blocks.hardware.msp_peer import yamspy

GIVEN: dict[str, Any] = {
    "port": "pty:fc", "channels": [1, 3], "lowest": [-1.0, 0.0], "highest": [1.0, 1.0],
    "initial": [0.0, 0.0], "safe": [0.0, 0.0],
}  # fmt: skip


def test_version_1_is_what_yamspy_sends() -> None:
    peer = yamspy()
    peer.send_RAW_RC([1250, 1000, 1750, 1000, 1000, 1000, 1000, 1000])
    assert MspRcOut(**GIVEN, version="v1").frame(np.array([-0.5, 0.75])) == peer.conn.sent


def test_yamspy_reads_version_2() -> None:
    frame = MspRcOut(**GIVEN, count=4, others=1500.0).frame(np.array([1.0, 9.0]))
    peer = yamspy(frame)
    found = peer.receive_msg()
    assert (found["code"], found["crcError"], found["msp_version"]) == (SET_RAW_RC, False, 2)
    assert np.frombuffer(bytes(found["dataView"]), "<u2").tolist() == [2000, 1500, 2000, 1500]


def test_a_peer_reads_the_commands_and_after_a_kill_the_safe_bytes() -> None:
    device = MspRcOut(**GIVEN)
    found = drive_output(device, command=[[0.5, 0.5], [-1.0, 1.0]])
    assert found.commands == [device.frame(np.array(each)) for each in ([0.5, 0.5], [-1.0, 1.0])]
    assert found.safe == device.safe_frame() and found.wire.endswith(2 * found.safe)


def test_sent_is_the_command_in_whole_microseconds() -> None:
    sent = drive(MspRcOut(**GIVEN), command=[[0.12345, 0.5], [3.0, -3.0]]).sent
    np.testing.assert_allclose(sent, [[0.124, 0.5], [1.0, 0.0]], atol=1e-9)


@pytest.mark.parametrize(
    ("given", "parameter", "words"),
    [
        ({"channels": [1, 9]}, "channels", "channels must be at most 8, the count that is sent; give"),
        ({"channels": [1, 19]}, "channels", "channels must be at most 18, got 19"),
        ({"spacing": 0.2}, "spacing", "spacing must be at most 0.15 s, got 0.2 s"),
        ({"safe": [2.0, 0.0]}, "safe", "safe must lie between lowest and highest, element by element"),
        ({"baud": 9600, "spacing": 0.01}, "spacing", "a frame of 25 bytes takes 26 ms at 9600 baud 8N1"),
    ],
)  # fmt: skip
def test_what_a_controller_would_not_take_is_refused(
    given: dict[str, Any], parameter: str, words: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        MspRcOut(**{**GIVEN, **given})
    assert (caught.value.parameter, words in str(caught.value)) == (parameter, True), str(caught.value)


def test_the_two_versions_differ_in_their_heads() -> None:
    assert MspRcOut(**GIVEN).safe_frame()[:3] == b"$X<"
    assert MspRcOut(**GIVEN, version="v1").safe_frame()[:4] == b"$M<\x10"
    assert V1 == 1
