"""Checksums: those of the catalogue of CRCs, and those of a library that we did not write."""

from __future__ import annotations

from typing import Any

import crccheck
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_blocks.hardware._protocol.checksums import CRCS, NAMES, Crc, algorithm, computing

# The name that the library has for each.
LIBRARY = {
    "crc8": "Crc8Smbus",
    "crc8_autosar": "Crc8Autosar",
    "crc8_dvb_s2": "Crc8DvbS2",
    "crc8_maxim": "Crc8Maxim",
    "crc8_sae_j1850": "Crc8SaeJ1850",
    "crc16_arc": "Crc16Arc",
    "crc16_ccitt_false": "Crc16CcittFalse",
    "crc16_kermit": "Crc16Kermit",
    "crc16_mcrf4xx": "Crc16Mcrf4XX",
    "crc16_modbus": "Crc16Modbus",
    "crc16_x25": "Crc16X25",
    "crc16_xmodem": "Crc16Xmodem",
    "crc32": "Crc32",
    "crc32_mpeg2": "Crc32Mpeg2",
    "crc32c": "Crc32C",
}
BLOCK = b"123456789"  # of which the catalogue states the checksum


def peer(name: str) -> Any:
    return getattr(crccheck.crc, LIBRARY[name])


def test_each_crc_has_a_peer() -> None:
    assert LIBRARY.keys() == CRCS.keys()


@pytest.mark.parametrize("name", CRCS)
def test_a_crc_of_the_catalogues_bytes_is_the_one_that_it_states(name: str) -> None:
    assert algorithm(name).compute(BLOCK) == peer(name)._check_result
    assert algorithm(name).size == peer(name)._width // 8


@pytest.mark.parametrize("name", CRCS)
@given(data=st.binary(max_size=60))
def test_a_crc_is_that_of_the_library(name: str, data: bytes) -> None:
    assert algorithm(name).compute(data) == peer(name).calc(data)


@given(st.binary(max_size=60))
def test_sums_are_those_of_the_library(data: bytes) -> None:
    assert algorithm("sum8").compute(data) == crccheck.checksum.Checksum8.calc(data)
    assert algorithm("xor").compute(data) == crccheck.checksum.ChecksumXor8.calc(data)
    assert (algorithm("sum8_negated").compute(data) + sum(data)) % 256 == 0


def test_the_sums_of_ubx_are_those_of_its_manual() -> None:
    poll = bytes.fromhex("0a040000")  # UBX-MON-VER, polled: B5 62 0A 04 00 00 0E 34
    assert algorithm("fletcher16").compute(poll).to_bytes(2, "little") == bytes.fromhex("0e34")


@given(
    st.sampled_from([8, 16, 24, 32]),
    st.booleans(),
    st.data(),
    st.binary(max_size=40),
)
def test_a_crc_of_ones_own_is_that_of_the_library(
    width: int, reflected: bool, draw: st.DataObject, data: bytes
) -> None:
    numbers = [draw.draw(st.integers(0, (1 << width) - 1)) for _ in range(3)]
    made = Crc(width, numbers[0], numbers[1], reflected, numbers[2])
    other = crccheck.crc.Crc(width, numbers[0], numbers[1], reflected, reflected, numbers[2])
    other.process(data)
    assert computing(made)(data) == other.final()


def test_no_two_names_mean_one_checksum() -> None:
    assert len({algorithm(name).compute(bytes(range(40))) for name in NAMES}) == len(NAMES)
