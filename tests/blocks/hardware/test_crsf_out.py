"""Tests of the block hardware.crsf_out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from crsf_parser.payloads import PacketsTypes
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive, drive_output
from quadvis_blocks.hardware._crsf import checksum, encode
from quadvis_blocks.hardware.crsf_out import CrsfOut
from tests.blocks.hardware.crsf_frames import CENTRE, by_parser


def device(**given: Any) -> CrsfOut:
    """Return a device with one channel for each of two commands from -1 to 1, or as given."""
    return CrsfOut(
        **{
            "port": "pty:rc", "channels": [1, 3], "lowest": [-1.0, -1.0], "highest": [1.0, 1.0],
            "initial": [0.0, -1.0], "safe": [0.0, -1.0], **given,
        }
    )  # fmt: skip


def channels(frame: bytes) -> list[int]:
    """Return the 16 counts that another program reads."""
    found: list[int] = by_parser(b"\xc8" + frame[1:])[PacketsTypes.RC_CHANNELS_PACKED]
    return found


def test_frames_and_checksums_are_those_that_others_have_published() -> None:
    assert encode([992] * 16) == CENTRE
    assert checksum(b"123456789") == 0xBC


@given(st.lists(st.floats(-1.2, 1.2), min_size=2, max_size=2))
def test_another_program_reads_the_commands(command: list[float]) -> None:
    found = channels(device().frame(np.array(command)))
    wanted = 992 + 819.5 * np.clip(command, -1, 1)
    assert [found[0], found[2]] == pytest.approx(wanted, abs=1.01)
    assert {*found[1:2], *found[3:]} == {172}


def test_pulses_can_have_another_range_and_the_other_channels_be_elsewhere() -> None:
    ends = {"shortest": 1000.0, "longest": 2000.0, "highest": [-3.0, 1.0]}
    made = device(**ends, others=992, initial=[-1, 0], safe=[-3, 0])
    found = channels(made.frame(np.array([-1.0, 1.0])))
    assert found[:4] == [192, 992, 1792, 992]
    assert channels(made.safe_frame())[:3] == [1792, 992, 992]


def test_a_module_has_another_first_byte() -> None:
    assert device(to="module").frame(np.zeros(2)) == b"\xee" + device().frame(np.zeros(2))[1:]


def test_a_pulse_changes_no_faster_than_it_may_and_the_safe_frame_comes_at_once() -> None:
    made = drive(device(slew=1024.375), command=np.array([[1.0, 1.0]] * 12), rate="10 Hz")  # 0.2 a step
    assert made.sent[:, 0] == pytest.approx([0.2, 0.4, 0.6, 0.8, *[1.0] * 8], abs=1.1 / 1639)
    assert made.sent[:, 1] == pytest.approx([*np.arange(-0.8, 0.9, 0.2), 1.0, 1.0, 1.0], abs=1.1 / 1639)
    sent: list[bytes] = []
    engine = made.engine
    engine.bound("block").deliver = sent.append
    with engine:
        engine.run(3)
    assert [channels(frame)[0] for frame in sent[:3]] == pytest.approx(
        [992 + 163.9 * k for k in (1, 2, 3)], abs=1
    )
    assert sent[-1] == device().safe_frame()


def test_a_peer_reads_the_commands_and_after_a_kill_the_safe_bytes() -> None:
    found = drive_output(device(), command=[[0.5, 1.0], [-1.0, 0.0]])
    assert [channels(frame)[:3:2] for frame in found.commands] == [[1401, 1811], [172, 992]]
    assert channels(found.initial)[:3:2] == channels(found.safe)[:3:2] == [992, 172]
    assert found.wire.endswith(2 * found.safe)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"safe": [0.0, 2.0]}, "safe must lie between lowest and highest, element by element"),
        ({"initial": [-1.5, 0.0]}, "initial must lie between lowest and highest, element by element"),
        ({"channels": [3, 3]}, "channels must be different from each other"),
        ({"channels": [3, 17]}, "channels must be at most 16, got 17"),
        ({"slew": 0.0}, "slew must be above 0 us/s, got 0 us/s"),
        ({"shortest": 2000.0, "longest": 1500.0}, "longest must be above shortest"),
        (
            {"baud": 9600},
            "a frame of 26 bytes takes 27.1 ms at 9600 baud 8N1, and one is due every 10 ms",
        ),
    ],
)
def test_what_cannot_be_sent_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        device(**given)
    assert str(caught.value).startswith(words)
