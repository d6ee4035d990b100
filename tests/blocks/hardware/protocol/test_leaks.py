"""What a checksum is worth: the estimate that `quadvis check` states, against damaged messages."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadvis.block import Counted
from quadvis_blocks.hardware._protocol.decode import Decoded, decoding
from quadvis_blocks.hardware._protocol.description import ProtocolMessage
from quadvis_blocks.hardware._protocol.encode import encode
from quadvis_blocks.hardware._protocol.leaks import wrong_per_million
from tests.blocks.hardware.protocol.damage import finder, flipped, taken
from tests.blocks.hardware.protocol.protocols import message

TEXT = """
quadvis: 1
name: text
messages:
  imu:
    header: $
    fields:
      - IMU
      - {name: rates, format: "%.4f", elements: 6, range: [-500, 500]}
    separator: ","
    checksum: KIND
    terminator: "\\r\\n"
"""
BYTES = """
quadvis: 1
name: bytes
order: little
messages:
  imu:
    header: [0xB5, 0x62]
    fields: [{name: rates, type: i16, elements: 9, scale: 0.01}]
    checksum: KIND
"""


def made(text: str, kind: str, folder: Path) -> ProtocolMessage:
    return message(text.replace("KIND", kind), "imu", folder)


def counted(kind: ProtocolMessage, count: int) -> float:
    """Return how many of a million damaged messages give wrong values."""
    random = np.random.default_rng(3)
    several, decode, wrong = 500, decoding(kind), 0
    elements = kind.values[0].elements
    good = [encode(kind, [random.uniform(-320, 320, elements)]) for _ in range(several)]
    for _ in range(count // several):
        for each in good:
            spoilt = flipped(each, random)
            found = decode(spoilt) if spoilt != each else None
            if isinstance(found, Decoded):
                right = decode(each)
                assert isinstance(right, Decoded)
                wrong += not np.array_equal(found.values[0], right.values[0])
    return 1e6 * wrong / (count // several * several)


@pytest.mark.parametrize("text", [TEXT, BYTES])
@pytest.mark.parametrize(
    ("kind", "count", "factor"),
    [
        ("none", 10_000, 1.3),
        ("xor", 20_000, 2.5),
        pytest.param("sum8", 200_000, 2.0, marks=pytest.mark.slow),
        pytest.param("crc8", 300_000, 3.0, marks=pytest.mark.long),
    ],
)
def test_the_estimate_is_about_what_happens(
    tmp_path: Path, text: str, kind: str, count: int, factor: float
) -> None:
    subject = made(text, kind, tmp_path)
    expected, found = wrong_per_million(subject), counted(subject, count)
    assert expected / factor <= found <= expected * factor


@pytest.mark.parametrize("text", [TEXT, BYTES])
@pytest.mark.parametrize("kind", ["crc16_ccitt_false", "crc16_modbus", "crc32", "crc16_mcrf4xx", "crc16_x25"])
def test_of_a_strong_checksum_less_than_one_of_a_million_is_expected(
    tmp_path: Path, text: str, kind: str
) -> None:
    assert wrong_per_million(made(text, kind, tmp_path)) < 0.5


def test_the_sums_of_ubx_do_not_see_the_highest_bits_of_two_bytes(tmp_path: Path) -> None:
    subject = made(BYTES, "fletcher16", tmp_path)
    assert wrong_per_million(subject) == pytest.approx(100, rel=0.2)
    good = encode(subject, [np.zeros(9)])
    spoilt = bytearray(good)
    spoilt[4] ^= 0x80
    spoilt[6] ^= 0x80
    assert not isinstance(taken(finder(subject), bytes(spoilt))[0], Counted)
