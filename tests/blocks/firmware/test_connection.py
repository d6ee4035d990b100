"""The configuration port over loopback: answers in pieces, among damage, and its end."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_blocks.firmware._connection import FirmwareError, MspConnection
from quadvis_blocks.hardware._msp import ANSWER, REFUSAL, REQUEST, SET_RAW_RC, STATUS_EX, V1, encode, take

PATIENCE = 20.0  # s


class Pair:
    """A connection and the firmware's end of it."""

    def __init__(self) -> None:
        with socket.create_server(("127.0.0.1", 0)) as server:
            self.connection = MspConnection(*server.getsockname(), PATIENCE)
            self.peer = server.accept()[0]
        self.peer.settimeout(PATIENCE)

    def close(self) -> None:
        self.connection.close()
        self.peer.close()


@pytest.fixture(scope="module")
def pair() -> Iterator[Pair]:
    made = Pair()
    yield made
    made.close()


def test_a_command_arrives_as_a_request_of_version_1(pair: Pair) -> None:
    pair.connection.send(SET_RAW_RC, b"\x01\x02")
    (message,) = take(bytearray(pair.peer.recv(100)))
    assert message == (SET_RAW_RC, b"\x01\x02", REQUEST)


@given(
    st.lists(st.tuples(st.integers(0, 255), st.binary(max_size=255), st.sampled_from([ANSWER, REFUSAL]))),
    st.integers(1, 700),
)
def test_answers_are_whole_however_they_are_cut(
    pair: Pair, sent: list[tuple[int, bytes, int]], cut: int
) -> None:
    last = encode(STATUS_EX, b"last", version=V1, direction=ANSWER)
    data = b"".join(encode(c, p, version=V1, direction=d) for c, p, d in sent)
    data += encode(1, b"", version=V1, direction=REQUEST)  # no answer, so it is dropped
    found: list[tuple[int, bytes, int]] = []
    for start in range(0, len(data), cut):
        pair.peer.sendall(data[start : start + cut])
        found += pair.connection.answers()
    pair.peer.sendall(last)
    while not found or found[-1] != (STATUS_EX, b"last", ANSWER):
        found += pair.connection.answers(PATIENCE)
    assert found[:-1] == sent


def test_damage_costs_the_answer_that_it_hit(pair: Pair) -> None:
    whole = encode(STATUS_EX, b"payload", version=V1, direction=ANSWER)
    spoilt = bytearray(whole)
    spoilt[7] ^= 0x10
    pair.peer.sendall(b"noise $M" + bytes(spoilt) + whole)
    found = []
    while not found:
        found = pair.connection.answers(PATIENCE)
    assert found == [(STATUS_EX, b"payload", ANSWER)]
    assert pair.connection.answers() == []


def test_a_firmware_that_reads_nothing_holds_nobody_up() -> None:
    pair = Pair()
    for _ in range(5_000):
        pair.connection.send(SET_RAW_RC, bytes(255))
    pair.close()


def test_a_port_that_is_closed_ends_it_in_a_sentence() -> None:
    pair = Pair()
    pair.peer.close()
    with pytest.raises(FirmwareError, match="it has closed its configuration port"):
        pair.connection.answers(PATIENCE)
    with pytest.raises(FirmwareError, match=r"it has closed its configuration port|takes no bytes"):
        for _ in range(1000):
            pair.connection.send(STATUS_EX)
            pair.connection.write(b"#")
    pair.close()
