"""Whole messages: bytes of values and values of bytes, against Python's struct and pynmea2."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pynmea2
import pytest
from crccheck.crc import Crc16Modbus
from hypothesis import given
from hypothesis import strategies as st

from quadvis_blocks.hardware._protocol.counting import MessageCounter
from quadvis_blocks.hardware._protocol.decode import Damage, Decoded, decoding
from quadvis_blocks.hardware._protocol.description import ProtocolMessage
from quadvis_blocks.hardware._protocol.encode import encode
from tests.blocks.hardware.protocol.protocols import BYTES, NMEA, message

DEGREE = math.pi / 180


@pytest.fixture(scope="module")
def imu(tmp_path_factory: pytest.TempPathFactory) -> ProtocolMessage:
    return message(BYTES, "imu", tmp_path_factory.mktemp("imu"))


@pytest.fixture(scope="module")
def depth(tmp_path_factory: pytest.TempPathFactory) -> ProtocolMessage:
    return message(NMEA, "depth", tmp_path_factory.mktemp("depth"))


@pytest.fixture(scope="module")
def fix(tmp_path_factory: pytest.TempPathFactory) -> ProtocolMessage:
    return message(NMEA, "fix", tmp_path_factory.mktemp("fix"))


def theirs(
    gyro: list[int],
    temperature: int,
    mode: int,
    trim: int,
    armed: int,
    height: float,
    ticks: int,
    number: int = 0,
) -> bytes:
    """Return the message as its manual would have it, made by struct and crccheck."""
    bits = mode | (trim & 0x3F) << 5 | armed << 11
    body = struct.pack(">H", number) + struct.pack("<3hB2xHf", *gyro, temperature, bits, height)
    body += struct.pack(">I", ticks)
    data = bytes([0xAA, 0x55, len(body) + 1, 0x10]) + body
    return data + struct.pack("<H", Crc16Modbus.calc(data)) + b"\r"


NUMBERS = st.tuples(
    st.lists(st.integers(-32000, 32000), min_size=3, max_size=3),
    st.integers(0, 255),
    st.integers(0, 7),
    st.integers(-32, 31),
    st.integers(0, 1),
    st.floats(-1, 50, width=32).map(lambda height: height + 0.0),  # no -0
    st.integers(0, 2**32 - 1),
)


@given(NUMBERS, st.integers(0, 999))
def test_bytes_are_those_of_struct_and_mean_what_the_file_says(
    imu: ProtocolMessage, numbers: tuple[Any, ...], counter: int
) -> None:
    gyro, temperature, mode, trim, armed, height, ticks = numbers
    found = decoding(imu)(theirs(*numbers, number=counter))
    assert isinstance(found, Decoded)
    assert found.counter == counter
    values = found.values
    assert values[0] == pytest.approx(np.array(gyro) * 0.01 * DEGREE, rel=1e-12)
    assert values[1] == pytest.approx(temperature * 0.5 - 40)
    assert values[3] == pytest.approx(trim * 0.1)
    assert (values[2], *values[4:]) == (mode, armed, height, ticks)
    assert encode(imu, values) == theirs(*numbers)


@given(st.lists(st.floats(-20, 20), min_size=3, max_size=3), st.tuples(*[st.floats(-1e9, 1e9)] * 6))
def test_what_is_sent_is_in_range_and_nearest_to_what_was_meant(
    imu: ProtocolMessage, rates: list[float], others: tuple[float, ...]
) -> None:
    found = decoding(imu)(encode(imu, [np.array(rates), *others]))
    assert isinstance(found, Decoded)
    limited = np.clip(rates, -320 * DEGREE, 320 * DEGREE)
    assert found.values[0] == pytest.approx(limited, abs=0.0051 * DEGREE)
    assert (np.abs(found.values[0]) <= 320 * DEGREE * (1 + 1e-12)).all()
    for value, meant, low, high, step in (
        (found.values[1], others[0], -40.0, 87.5, 0.5),
        (found.values[2], others[1], 0, 7, 1),
        (found.values[3], others[2], -3.2, 3.1, 0.1),
        (found.values[4], others[3], 0, 1, 1),
        (found.values[5], others[4], -1, 50, 1e-5),
        (found.values[6], others[5], 0, 2**32 - 1, 1),
    ):
        assert value == pytest.approx(min(max(meant, low), high), abs=step * 0.51)


@pytest.mark.parametrize(
    ("numbers", "is_good"),
    [
        (([32001, 0, 0], 0, 0, 0, 0, 0.0, 0), False),  # deg/s beyond the range
        (([32000, 0, 0], 0, 0, 0, 0, 50.0, 0), True),
        (([0, 0, 0], 0, 0, 0, 0, 50.001, 0), False),
        (([0, 0, 0], 0, 0, 0, 0, math.nan, 0), False),
        (([0, 0, 0], 0, 0, 0, 0, math.inf, 0), False),
        (([0, 0, 0], 0, 0, 0, 0, -math.inf, 0), False),
    ],
)
def test_values_that_are_not_finite_or_out_of_range_are_refused(
    imu: ProtocolMessage, numbers: tuple[Any, ...], is_good: bool
) -> None:
    found = decoding(imu)(theirs(*numbers))
    assert isinstance(found, Decoded) if is_good else found is Damage.VALUE


def test_a_checksum_that_is_wrong_and_fixed_bytes_that_differ_are_not_taken(imu: ProtocolMessage) -> None:
    good = theirs([0, 0, 0], 0, 0, 0, 0, 0.0, 0)
    decode = decoding(imu)
    for at in range(len(good)):
        for bit in range(8):
            spoilt = bytearray(good)
            spoilt[at] ^= 1 << bit
            assert decode(bytes(spoilt)) in (None, Damage.CHECKSUM)
    assert decode(good[:-1]) is None
    assert decode(good + b"\0") is None


def test_messages_are_numbered_when_they_are_sent(imu: ProtocolMessage) -> None:
    counter, frame = MessageCounter(imu), theirs([1, 2, 3], 4, 5, 6, 1, 7.5, 8)
    sent = [counter.seal(frame, 0) for _ in range(1002)]
    assert sent[:3] == [theirs([1, 2, 3], 4, 5, 6, 1, 7.5, 8, number) for number in range(3)]
    assert sent[999:1001] == [theirs([1, 2, 3], 4, 5, 6, 1, 7.5, 8, number) for number in (999, 0)]


def test_lines_are_numbered_when_they_are_sent(tmp_path: Path) -> None:
    text = NMEA.replace("- SDDPT\n", "- SDDPT\n      - {counter: 12, format: '%02d'}\n")
    made = message(text, "depth", tmp_path)
    counter, decode = MessageCounter(made), decoding(made)
    frame = encode(made, [1.5, 0.5])
    lines = [counter.seal(frame, 0) for _ in range(14)]
    assert lines[11].startswith(b"$SDDPT,11,1.5,0.5*")
    assert [decode(line) for line in lines] == [Decoded((1.5, 0.5), number % 12) for number in range(14)]


# NMEA 0183, as pynmea2 has it.


@given(st.floats(0, 200), st.one_of(st.just(math.nan), st.floats(-10, 10)))
def test_pynmea2_reads_our_lines(depth: ProtocolMessage, below: float, keel: float) -> None:
    line = encode(depth, [below, keel])
    assert line.endswith(b"\r\n")
    read = pynmea2.parse(line.decode().strip(), check=True)
    assert float(read.depth) == pytest.approx(below, abs=0.0501)
    assert (
        read.offset in (None, "")
        if math.isnan(keel)
        else float(read.offset) == pytest.approx(keel, abs=0.0501)
    )


@given(st.floats(0, 200), st.one_of(st.none(), st.floats(-10, 10)))
def test_we_read_the_lines_of_pynmea2(depth: ProtocolMessage, below: float, keel: float | None) -> None:
    fields = (f"{below:.1f}", "" if keel is None else f"{keel:.1f}")
    line = str(pynmea2.DPT("SD", "DPT", fields)).encode() + b"\r\n"
    found = decoding(depth)(line)
    assert isinstance(found, Decoded)
    assert found.values[0] == float(fields[0])
    assert math.isnan(found.values[1]) if keel is None else found.values[1] == float(fields[1])


@given(st.integers(0, 89), st.floats(0, 59.99), st.booleans(), st.booleans(), st.booleans())
def test_words_stand_for_numbers(
    fix: ProtocolMessage, degrees: int, minutes: float, north: bool, east: bool, good: bool
) -> None:
    place = f"{degrees:02d}{minutes:06.3f}"
    fields = (place, "NS"[not north], f"0{place}", "EW"[not east], "123519", "AV"[not good])
    line = str(pynmea2.GLL("GP", "GLL", fields)).encode() + b"\r\n"
    found = decoding(fix)(line)
    assert isinstance(found, Decoded)
    assert found.values == (float(place), 1 if north else -1, float(place), 1 if east else -1, int(good))


@pytest.mark.parametrize(
    ("line", "is_good"),
    [
        ("$SDDPT,12.5,0.3*", True),
        ("$SDDPT, 12.5 ,+.3*", True),
        ("$SDDPT,12.,-0*", True),
        ("$SDDPT,12.5*", False),
        ("$SDDPT,12.5,0.3,4*", False),
        ("$SDDPT,1e1,0.3*", False),
        ("$SDDPT,nan,0.3*", False),
        ("$SDDPT,inf,0.3*", False),
        ("$SDDPT,1_2,0.3*", False),
        ("$SDDPT,,0.3*", False),
        ("$SDDPT,0x1,0.3*", False),
        ("$SDDPT,1 2,0.3*", False),
        ("$SDDPT,--1,0.3*", False),
        ("$SDDPT,200.1,0.3*", False),
        ("$SDDPT,-0.1,0.3*", False),
        ("$SDDPS,12.5,0.3*", False),
        (f"$SDDPT,{'1' * 30},0.3*", False),
    ],
)
def test_a_number_in_text_is_one_as_printf_writes_it(
    depth: ProtocolMessage, line: str, is_good: bool
) -> None:
    whole = f"{line}{pynmea2.NMEASentence.checksum(line[1:-1]):02x}\r\n".encode()
    assert isinstance(decoding(depth)(whole), Decoded) is is_good


def test_blanks_between_numbers_never_take_long(tmp_path: Path) -> None:
    """Each gap could be split in many ways, and so the line in too many to try."""
    text = NMEA.replace('separator: ","', 'separator: " "').replace("range: [0, 200]", "elements: 12")
    made = message(text, "depth", tmp_path)
    values = [np.arange(12.0), 1.0]
    assert isinstance(decoding(made)(encode(made, values)), Decoded)
    assert decoding(made)(b"$SDDPT" + 30 * b" " + (30 * b" ").join([b"1"] * 13) + b"x*00\r\n") is None
    wide = encode(made, values).replace(b" ", 20 * b" ")
    assert decoding(made)(wide) is Damage.CHECKSUM  # the form is right
