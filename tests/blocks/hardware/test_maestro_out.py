"""Tests of the block hardware.maestro_out, against the bytes in Pololu's user's guide."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import drive, drive_output
from quadvis_blocks.hardware._maestro import checksum
from quadvis_blocks.hardware.maestro_out import MaestroOut


def device(**given: Any) -> MaestroOut:
    """Return a device with one channel for each of two commands from 0 to 4000 us, or as given."""
    return MaestroOut(
        **{
            "port": "pty:servos", "channels": [1, 2], "lowest": [20.0, 20.0], "highest": [4000.0, 4000.0],
            "shortest": [20.0, 20.0], "longest": [4000.0, 4000.0], "initial": [1500.0, 1500.0],
            "safe": [1500.0, 1000.0], **given,
        }
    )  # fmt: skip


def one(channel: int, **more: Any) -> MaestroOut:
    ends = {name: [value] for name, value in (("lowest", 20.0), ("highest", 4000.0))}
    pulses = {"shortest": [20.0], "longest": [4000.0]}
    return device(channels=[channel], **ends, **pulses, initial=[1500.0], safe=[1500.0], **more)


def test_frames_are_those_of_the_users_guide() -> None:
    middle = np.array([1500.0])
    assert one(1).frame(middle) == bytes.fromhex("84 00 70 2e")
    assert one(1, protocol="pololu").frame(middle) == bytes.fromhex("aa 0c 04 00 70 2e")
    assert one(3).frame(middle) == bytes.fromhex("84 02 70 2e")
    limited = one(6, speed=3500.0).frame(middle)
    assert limited[:4] == bytes.fromhex("87 05 0c 01")  # 3.5 us/ms
    pair = device(channels=[4, 5], board="mini")
    assert pair.frame(np.array([1500.0, 1500.0])) == bytes.fromhex("9f 02 03 70 2e 70 2e")
    assert checksum(bytes.fromhex("83 01")) == 0x17
    assert device(go_home=True).safe_frame() == b"\xa2"
    assert device(go_home=True, protocol="pololu", number=5).safe_frame() == b"\xaa\x05\x22"


class Board:
    """A Maestro as its guide describes it: what a board does with bytes."""

    def __init__(self, crc: bool, device: int | None) -> None:
        self._crc, self._device = crc, device
        self.targets: dict[int, int] = {}
        self.limits: dict[tuple[int, int], int] = {}
        self.errors = 0

    def take(self, piece: bytes) -> None:
        starts = [place for place, byte in enumerate(piece) if byte & 0x80] + [len(piece)]
        for begin, end in pairwise(starts):
            self._command(piece[begin:end])

    def _command(self, whole: bytes) -> None:
        if self._crc:
            if divided(whole):
                self.errors += 1
                return
            whole = whole[:-1]
        if self._device is not None:
            assert whole[:2] == bytes([0xAA, self._device])
            whole = bytes([whole[2] | 0x80]) + whole[3:]
        command, data = whole[0], whole[1:]
        if command == 0x9F:
            count, first = data[:2]
            values = [data[2 + 2 * k] | data[3 + 2 * k] << 7 for k in range(count)]
            assert len(data) == 2 + 2 * count
            self.targets.update({first + k: value for k, value in enumerate(values)})
        else:
            channel, low, high = data
            value = low | high << 7
            if command == 0x84:
                self.targets[channel] = value
            else:
                self.limits[command, channel] = value


def divided(whole: bytes) -> int:
    """Return by the long division of the guide how far the checksum of a command is off; 0 if it is right."""
    bits = [byte >> place & 1 for byte in whole[:-1] for place in range(8)] + [0] * 7
    for place in range(len(bits) - 7):
        if bits[place]:
            for offset, bit in enumerate((1, 0, 0, 0, 1, 0, 0, 1)):
                bits[place + offset] ^= bit
    return sum(bit << place for place, bit in enumerate(bits[-7:])) ^ whole[-1]


@settings(max_examples=50)
@given(
    st.lists(st.integers(1, 24), min_size=1, max_size=24, unique=True),
    st.randoms(use_true_random=False),
    st.booleans(),
    st.sampled_from(["micro", "mini"]),
    st.sampled_from([None, 0, 12, 127]),
    st.sampled_from([(0.0, 0.0), (500.0, 0.0), (25.0, 625.0)]),
)
def test_a_board_by_the_guide_reads_targets_and_limits(
    channels: list[int], random: Any, crc: bool, board: str, number: int | None, limits: tuple[float, float]
) -> None:
    count = len(channels)
    command = [random.uniform(-1.5, 1.5) for _ in channels]
    made = device(
        channels=channels, lowest=[-1.0] * count, highest=[1.0] * count, shortest=[500.0] * count,
        longest=[2500.0] * count, initial=[0.0] * count, safe=[0.0] * count, crc=crc, board=board,
        protocol="compact" if number is None else "pololu", number=number or 0, spacing=0.2,
        speed=limits[0], acceleration=limits[1],
    )  # fmt: skip
    found = Board(crc, number)
    found.take(made.frame(np.array(command)))
    assert found.errors == 0
    wanted = 4 * (1500 + 1000 * np.clip(command, -1, 1))
    assert sorted(found.targets) == sorted(channel - 1 for channel in channels)
    assert [found.targets[channel - 1] for channel in channels] == pytest.approx(wanted, abs=0.51)
    speeds = {(0x87, channel - 1): limits[0] / 25 for channel in channels if limits[0]}
    accelerations = {(0x89, channel - 1): limits[1] / 312.5 for channel in channels if limits[1]}
    assert found.limits == speeds | accelerations
    damaged = bytearray(made.frame(np.array(command)))
    damaged[random.randrange(len(damaged))] ^= 1 << random.randrange(7)
    if crc and number is None:
        found.take(bytes(damaged))
        assert found.errors == 1


def test_sent_is_in_quarters_and_changes_no_faster_than_it_may() -> None:
    sent = drive(device(slew=1000.0), command=np.array([[1800.1, 1000.0]] * 5), rate="10 Hz").sent
    assert sent[:, 0] == pytest.approx([1600.0, 1700.0, 1800.0, 1800.0, 1800.0])
    assert sent[:, 1] == pytest.approx([1400.0, 1300.0, 1200.0, 1100.0, 1000.0])


@pytest.mark.slow
def test_a_peer_reads_the_commands_and_after_a_kill_the_order_to_go_home() -> None:
    found = drive_output(device(go_home=True, crc=True), command=[[1500.0, 2000.0]])
    board = Board(True, None)
    board.take(found.commands[0])
    assert board.targets == {0: 6000, 1: 8000} and board.errors == 0
    assert found.safe == bytes([0xA2, checksum(b"\xa2")])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"channels": [3, 25]}, "channels must be at most 24, got 25"),
        ({"shortest": [1000.0, 2000.0], "longest": [2000.0, 2000.0]}, "longest must be above shortest"),
        ({"longest": [2000.0, 5000.0]}, "longest must be at most 4095.75 us, got 5000 us"),
        ({"speed": 5.0}, "speed must be 0 or at least 25, the step of the board"),
        ({"acceleration": 5.0}, "acceleration must be 0 or at least 312.5, the step of the board"),
        ({"baud": 300}, "a frame of 8 bytes takes 267 ms at 300 baud 8N1, and one is due every 20 ms"),
    ],
)
def test_what_cannot_be_sent_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        device(**given)
    assert str(caught.value).startswith(words)
