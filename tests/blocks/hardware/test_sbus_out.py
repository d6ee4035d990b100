"""Tests of the block hardware.sbus_out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive, drive_output
from quadvis_blocks.hardware._sbus import decode, encode
from quadvis_blocks.hardware.sbus_out import SbusOut
from tests.blocks.hardware.sbus_frames import CENTRE, MIXED, MIXED_COUNTS, SWITCHES, SWITCHES_COUNTS


def device(**given: Any) -> SbusOut:
    """Return a device with one channel for each of two commands from -1 to 1, or as given."""
    return SbusOut(
        **{
            "port": "pty:rc", "channels": [1, 3], "lowest": [-1.0, -1.0], "highest": [1.0, 1.0],
            "initial": [0.0, -1.0], "safe": [0.0, -1.0], **given,
        }
    )  # fmt: skip


def test_frames_are_those_that_others_have_published() -> None:
    assert encode([992] * 16) == CENTRE
    assert encode(SWITCHES_COUNTS, 3) == SWITCHES
    assert encode(MIXED_COUNTS)[:23] == MIXED


@given(st.lists(st.integers(0, 2047), min_size=16, max_size=16), st.integers(0, 15))
def test_a_frame_says_what_it_was_made_of(counts: list[int], flags: int) -> None:
    assert decode(encode(counts, flags)) == (counts, flags)


def test_the_ends_of_a_command_are_those_of_a_stick_and_each_has_its_channel() -> None:
    counts = [decode(device().frame(np.array(command))) for command in ([-1.0, 1.0], [1.0, 0.0], [9.0, -9.0])]
    assert [(each.counts[0], each.counts[2]) for each in counts if each] == [
        (172, 1811),
        (1811, 992),
        (1811, 172),
    ]
    others = {count for each in counts if each for count in (each.counts[1], *each.counts[3:])}
    assert others == {172}


def test_a_channel_can_be_reversed_and_the_others_be_elsewhere() -> None:
    frame = decode(
        device(highest=[1.0, -3.0], others=1000, initial=[0, -2], safe=[0, -2]).frame(np.array([0, -3]))
    )
    assert frame is not None
    assert frame.counts[:4] == [992, 1000, 1811, 1000]


def test_sent_is_the_command_as_a_receiver_reads_it() -> None:
    sent = drive(device(), command=[[0.3, -0.7], [5.0, -5.0]]).sent
    assert sent[0] == pytest.approx([0.3, -0.7], abs=1 / 1639)
    assert sent[1].tolist() == [1.0, -1.0]
    counts = 172 + 1639 * (sent + 1) / 2
    assert counts == pytest.approx(np.rint(counts), abs=1e-9)


def test_only_safe_frames_have_the_failsafe_flag_and_only_if_asked_for() -> None:
    assert device().safe_frame()[23] == 0
    flagged = device(failsafe_flag=True)
    assert [flagged.safe_frame()[23], flagged.initial_frame()[23], flagged.frame(np.zeros(2))[23]] == [
        8,
        0,
        0,
    ]


def test_a_peer_reads_the_commands_and_after_a_kill_the_safe_bytes() -> None:
    channels = list(range(1, 17))
    ends = {"lowest": [-820.0] * 16, "highest": [819.0] * 16}  # so that counts are 992 more than commands
    given = {
        "channels": channels,
        **ends,
        "initial": [0.0] * 16,
        "safe": np.array([992, 992, *[172] * 14]) - 992,
    }
    used = [count if 172 <= count <= 1811 else 992 for count in MIXED_COUNTS]
    found = drive_output(device(**given), command=[np.array(used) - 992.0, np.zeros(16)])
    assert found.initial == CENTRE
    assert found.commands == [encode(used), CENTRE]
    assert found.safe == encode([992, 992, *[172] * 14])
    assert found.wire.endswith(2 * found.safe)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"safe": [0.0, 2.0]}, "safe must lie between lowest and highest, element by element"),
        ({"initial": [-1.5, 0.0]}, "initial must lie between lowest and highest, element by element"),
        ({"channels": [3, 3]}, "channels must be different from each other"),
        ({"highest": [1.0, -1.0]}, "highest must be different from lowest, element by element"),
        ({"channels": [0, 3]}, "channels must be at least 1, got 0"),
        ({"spacing": 0.005}, "spacing must be at least 0.006 s, got 0.005 s"),
        (
            {"port": "pty:"},
            "port must be the path of a port, such as /dev/ttyUSB0, udp:HOST:PORT or pty:NAME, got 'pty:'",
        ),
    ],
)
def test_what_cannot_be_sent_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        device(**given)
    assert str(caught.value) == words


def test_a_command_that_is_missing_is_an_error() -> None:
    with pytest.raises(ValueError, match="NaN"):
        device().frame(np.array([np.nan, 0.0]))
