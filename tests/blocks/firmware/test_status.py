"""What the firmware says about itself, compared with yamspy, which we did not write."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_blocks.firmware._status import REASONS, Status, arming_ranges, words
from quadvis_blocks.hardware._msp import ANSWER, MODE_RANGES, STATUS_EX, V1, encode
from tests.blocks.hardware.msp_peer import read_by_yamspy

u32 = st.integers(0, 2**32 - 1)


def status(modes: int, reasons: int, further: bytes = b"") -> bytes:
    head = struct.pack("<3HIBH3B", 125, 0, 35, modes, 0, 7, 4, 0, len(further))
    return head + further + struct.pack("<BI", 29, reasons) + b"\0"


@given(u32, u32, st.binary(max_size=4))
def test_modes_and_reasons_are_those_that_yamspy_reads(modes: int, reasons: int, further: bytes) -> None:
    payload = status(modes, reasons, further)
    found = Status.of(payload)
    assert found is not None
    peer = read_by_yamspy(encode(STATUS_EX, payload, version=V1, direction=ANSWER)).CONFIG
    assert (found.modes & 0xFFFFFFFF, found.reasons) == (peer["mode"], peer["armingDisableFlags"])
    assert list((found.modes >> 32).to_bytes(len(further), "little")) == peer["flightModeFlags"]


@given(st.binary(max_size=40))
def test_any_bytes_are_a_status_or_none(payload: bytes) -> None:
    found = Status.of(payload)
    assert found is None or (len(payload) >= 21 and 0 <= found.reasons < 2**32)


@pytest.mark.parametrize(
    ("reasons", "text"),
    [
        (0, "it gives none"),
        (1 << 7 | 1 << 2, "no receiver signal, or not for long enough; throttle not low"),
        (1 << 28, "the arm switch is on: switch it off and on again"),
        (1 << 31, "reason 31"),
    ],
)
def test_reasons_are_named_in_words(reasons: int, text: str) -> None:
    assert words(reasons) == text
    assert len(REASONS) == 29


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 13), st.integers(0, 48), st.integers(0, 48))))
def test_the_ranges_that_arm_are_those_that_yamspy_reads(rows: list[tuple[int, int, int, int]]) -> None:
    payload = b"".join(bytes(row) for row in rows[:20])
    peer = read_by_yamspy(encode(MODE_RANGES, payload, version=V1, direction=ANSWER)).MODE_RANGES
    wanted = [
        (4 + each["auxChannelIndex"], each["range"]["start"], each["range"]["end"])
        for each in peer
        if each["id"] == 0 and each["range"]["start"] < each["range"]["end"]
    ]
    found = arming_ranges(payload)
    assert [tuple(span) for span in found] == wanted
    for channel, first, last in wanted:
        span = next(each for each in found if each == (channel, first, last))
        pulses = [1500.0] * 18
        for pulse, holds in ((first, True), (last, False), (first - 1, False), ((first + last) / 2, True)):
            pulses[channel] = pulse
            assert span.holds(pulses) is holds
        assert not span.holds(pulses[:channel])
