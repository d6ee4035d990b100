"""Tests of the block hardware.ppm_out."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pikoder.ppm_encoder import PPMEncoder

from quadvis.block import ParameterError
from quadvis.testing import drive, drive_output
from quadvis_blocks.hardware.ppm_out import PpmOut


def device(**given: Any) -> PpmOut:
    """Return a device with one channel for each of two commands from -1 to 1, or as given."""
    return PpmOut(
        **{
            "port": "pty:ppm", "channels": [1, 3], "lowest": [-1.0, 1.0], "highest": [1.0, -1.0],
            "initial": [0.0, 1.0], "safe": [0.0, -1.0], **given,
        }
    )  # fmt: skip


class Wire:
    """What another program writes to its encoder."""

    def __init__(self) -> None:
        self.written = b""

    def write(self, piece: bytes) -> None:
        self.written += piece


def encoded(**pulses: int) -> bytes:
    """Return what the package pikoder-ppm-encoder sends for these pulses (us): `encoded(c1=1500)`."""
    wire = Wire()
    encoder = PPMEncoder(wire)
    for channel, pulse in pulses.items():
        encoder.set_channel_raw(int(channel[1:]), pulse)
    return wire.written


def test_a_frame_is_what_another_program_sends_to_the_encoder() -> None:
    assert device().frame(np.array([0.0, 0.0])) == encoded(c1=1500, c3=1500) == b"1=15003=1500"
    assert device().frame(np.array([-5.0, -0.5])) == encoded(c1=1000, c3=1750)
    assert device().safe_frame() == encoded(c1=1500, c3=2000)
    assert device().initial_frame() == encoded(c1=1500, c3=1000)


@given(
    st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=2),
    st.sampled_from([(750.0, 2250.0), (1000.0, 1900.0)]),
)
def test_a_frame_has_each_channel_once_within_its_pulses(
    command: list[float], ends: tuple[float, float]
) -> None:
    made = device(shortest=ends[0], longest=ends[1])
    found = re.fullmatch(rb"1=(\d{4})3=(\d{4})", made.frame(np.array(command)))
    assert found is not None
    share = (np.clip(command, -1, 1) * [1, -1] + 1) / 2
    wanted = ends[0] + share * (ends[1] - ends[0])
    assert [int(found[1]), int(found[2])] == pytest.approx(wanted, abs=0.51)


def test_sent_is_the_command_in_whole_microseconds_and_changes_no_faster_than_it_may() -> None:
    sent = drive(device(slew=1000.0), command=np.array([[1.0, -1.0]] * 7), rate="10 Hz").sent
    assert sent[:, 0] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 1.0])
    assert sent[:, 1] == pytest.approx([0.8, 0.6, 0.4, 0.2, 0.0, -0.2, -0.4])


@pytest.mark.slow
def test_a_peer_reads_the_commands_and_after_a_kill_the_safe_bytes() -> None:
    found = drive_output(device(baud=115_200, spacing=20e-3), command=[[0.5, 1.0], [-1.0, 0.0]])
    assert found.initial == b"1=15003=1000"
    assert found.commands == [b"1=17503=1000", b"1=10003=1500"]
    assert found.safe == b"1=15003=2000"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"channels": [3, 9]}, "channels must be at most 8, got 9"),
        ({"safe": [0.0, 2.0]}, "safe must lie between lowest and highest, element by element"),
        ({"spacing": 0.01}, "a frame of 12 bytes takes 12.5 ms at 9600 baud 8N1, and one is due every 10 ms"),
        ({"longest": 2500.0}, "longest must be at most 2250 us, got 2500 us"),
    ],
)
def test_what_cannot_be_sent_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        device(**given)
    assert str(caught.value).startswith(words)
