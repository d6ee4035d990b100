"""Packets as pymavlink makes and reads them."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega, common

from quadvis.block import ParameterError
from quadvis_blocks.mavlink._dialect import dialect
from quadvis_blocks.mavlink._packets import (
    LooseMessage,
    checksum,
    implied_extra,
    loose_messages,
    loosened,
    packet,
)
from tests.blocks.mavlink.pymavlink_peer import attitude, read, speaker

COMMON = dialect("common")


def test_the_checksum_is_that_of_its_catalogue() -> None:
    assert checksum(b"123456789") == 0x6F91


def test_each_message_is_packed_and_unpacked_as_pymavlink_does_it() -> None:
    for name, definition in COMMON.names.items():
        size = definition.layout.size
        payload = bytes((17 * place + len(name)) % 120 + 1 for place in range(size))  # finite as floats
        sent = _message(definition.number, payload)
        mav = speaker(7, 3)
        mav.seq = 200
        wire = sent.pack(mav)
        fields = definition.unpack(wire[10 : 10 + wire[1]])
        for field, value in fields.items():
            theirs = getattr(sent, field)
            theirs = theirs.encode() if isinstance(theirs, str) else theirs
            assert (tuple(theirs) if isinstance(value, tuple) else theirs) == value, (name, field)
        loose = LooseMessage(definition.number, definition.extra, definition.pack(**fields))
        assert packet(loose, 200, 7, 3) == wire, name


def _message(number: int, payload: bytes) -> Any:
    """Return the message of pymavlink that has this payload."""
    kind = common.mavlink_map[number]
    values = iter(kind.unpacker.unpack(payload))
    ordered = {
        name: [next(values) for _ in range(count)] if count > 1 else next(values)
        for name, count in zip(kind.ordered_fieldnames, kind.lengths, strict=True)
    }
    return kind(**ordered)


def test_fields_that_are_not_given_are_zero_and_others_are_refused() -> None:
    definition = COMMON.names["COMMAND_LONG"]
    assert definition.pack() == b"\0"
    assert definition.unpack(definition.pack(command=511, param1=30.0))["param1"] == 30.0
    with pytest.raises(TypeError, match="COMMAND_LONG has no field speed"):
        definition.pack(speed=1.0)


@given(st.binary(min_size=9, max_size=270), st.integers(0, 255))
def test_the_byte_of_the_definition_follows_from_the_checksum(body: bytes, extra: int) -> None:
    assert implied_extra(body, checksum(body + bytes([extra]))) == extra


def test_messages_travel_to_the_process_that_makes_packets_of_them() -> None:
    messages = [
        LooseMessage(30, 39, b"abc"),
        LooseMessage(0x123456, 1, bytes(255)),
        LooseMessage(0, 50, b"\0"),
    ]
    assert list(loose_messages(loosened(messages))) == messages


def test_pymavlink_reads_what_we_send_with_numbers_beyond_one_byte() -> None:
    definition = dialect("ardupilotmega").names["AOA_SSA"]
    loose = LooseMessage(definition.number, definition.extra, definition.pack(AOA=2.5, SSA=-1.0))
    reader = ardupilotmega.MAVLink(None)
    (found,) = reader.parse_buffer(packet(loose, 1, 2, 3))
    assert (found.get_type(), found.AOA, found.SSA) == ("AOA_SSA", 2.5, -1.0)
    assert [each.get_type() for each in read(packet(loose, 1, 2, 3))] == [f"UNKNOWN_{definition.number}"]


@pytest.mark.parametrize(
    "environment", [{}, {"MAVLINK09": "1"}, {"MAVLINK20": ""}, {"MAVLINK10": "1"}, {"MAV_IGNORE_CRC": "1"}]
)
@pytest.mark.slow
def test_version_2_is_spoken_and_checked_whatever_the_environment_says(environment: dict[str, str]) -> None:
    code = """
from quadvis_blocks.mavlink._dialect import dialect
from quadvis_blocks.mavlink._packets import LooseMessage, packet
from quadvis_blocks.mavlink._scanner import PacketScanner
kind = dialect("common").names["HEARTBEAT"]
sent = packet(LooseMessage(kind.number, kind.extra, kind.pack(type=2)), 0, 1, 1)
spoilt = sent[:-1] + bytes([sent[-1] ^ 1])
scanner = PacketScanner(dialect("common").numbers)
print(sent[0], len(list(scanner.take(bytearray(spoilt)))), len(list(scanner.take(bytearray(sent)))))
"""
    found = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert found.stdout.split() == ["253", "0", "1"]


def test_a_dialect_that_there_is_not_and_a_package_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ParameterError, match="dialect 'comon' is not one of pymavlink's; did you mean 'co"):
        dialect("comon")
    dialect.cache_clear()
    monkeypatch.setattr("quadvis_blocks.mavlink._dialect.find_spec", lambda _: None)
    with pytest.raises(ParameterError, match=r"need the package pymavlink; install quadvis\[mav\]"):
        dialect("common")


def test_first_packets_of_pymavlink_and_ours_are_the_same_bytes() -> None:
    definition = COMMON.names["ATTITUDE"]
    theirs = attitude(speaker(1, 1), 123)
    fields = definition.unpack(theirs[10:-2])
    assert packet(LooseMessage(30, definition.extra, definition.pack(**fields)), 0, 1, 1) == theirs
