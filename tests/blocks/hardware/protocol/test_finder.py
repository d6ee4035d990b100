"""Messages are found in any stream of bytes, none that is damaged is believed, and nothing grows."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.block import Counted
from quadvis_blocks.hardware._protocol.checksums import xor
from quadvis_blocks.hardware._protocol.decode import Decoded, decoding
from quadvis_blocks.hardware._protocol.description import LONGEST, DeviceProtocol, ProtocolMessage
from quadvis_blocks.hardware._protocol.encode import encode
from quadvis_blocks.hardware._protocol.reading import read_protocol
from tests.blocks.hardware.protocol.damage import finder, flipped, split, taken
from tests.blocks.hardware.protocol.protocols import BYTES, NMEA, protocol

LAB = Path(__file__).parents[4] / "diagrams" / "protocols" / "lab_imu.yaml"
KINDS = ("text", "nmea", "bytes")


@pytest.fixture(scope="module")
def protocols(tmp_path_factory: pytest.TempPathFactory) -> dict[str, DeviceProtocol]:
    folder = tmp_path_factory.mktemp("protocols")
    return {"text": read_protocol(LAB), "nmea": protocol(NMEA, folder), "bytes": protocol(BYTES, folder)}


def wanted(found: DeviceProtocol) -> ProtocolMessage:
    """Return the first message of a protocol."""
    return next(iter(found.messages.values()))


def numbers(message: ProtocolMessage, random: np.random.Generator) -> list[Any]:
    """Return random values of a message."""
    found = []
    for value in message.values:
        low, high = (max(-1000.0, value.bounds[0]), min(1000.0, value.bounds[1]))
        found.append(random.uniform(low, high, value.elements or None))
    return found


def stream(message: ProtocolMessage, count: int, seed: int = 1) -> list[bytes]:
    """Return random messages, with their numbers if they have some."""
    random = np.random.default_rng(seed)
    made = [encode(message, numbers(message, random)) for _ in range(count)]
    if not message.modulus:
        return made
    from quadvis_blocks.hardware._protocol.counting import MessageCounter

    counter = MessageCounter(message)
    return [counter.seal(each, 0) for each in made]


def said(message: ProtocolMessage, data: Sequence[bytes]) -> list[Any]:
    """Return the values of whole messages."""
    found = [decoding(message)(each) for each in data]
    return [each.values for each in found if isinstance(each, Decoded)]


def key(values: Sequence[Any]) -> bytes:
    """Return values in a form that can be looked up quickly."""
    return b"".join([np.asarray(value, float).tobytes() for value in values])


def same(one: Sequence[Any], other: Sequence[Any]) -> bool:
    """Return whether two lists of values are equal, to the bit."""
    return [*map(key, one)] == [*map(key, other)]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(data=st.data())
def test_what_is_found_does_not_depend_on_the_pieces(
    protocols: dict[str, DeviceProtocol], kind: str, data: st.DataObject
) -> None:
    message = wanted(protocols[kind])
    random = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    whole = flipped(b"".join(stream(message, 6)), random, 0.02)
    cuts = data.draw(st.lists(st.integers(0, len(whole)), max_size=5))
    whole = whole + data.draw(st.binary(max_size=30)) + b"".join(stream(message, 2))
    pieces = np.split(np.frombuffer(whole, np.uint8), sorted(cuts))
    search, received, found = finder(message, protocols[kind]), bytearray(), []
    for piece in pieces:
        received += piece.tobytes()
        found += list(search.take(received))
    at_once = taken(finder(message, protocols[kind]), whole, len(whole))
    one_by_one = taken(finder(message, protocols[kind]), whole, 1)
    assert same(split(found)[0], split(at_once)[0])
    assert same(split(one_by_one)[0], split(at_once)[0])
    assert split(found)[1] == split(at_once)[1] == split(one_by_one)[1]


@pytest.mark.parametrize("spoil", ["drop", "add", "flip"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_byte_too_few_too_many_or_wrong_costs_one_message(
    protocols: dict[str, DeviceProtocol], kind: str, spoil: str
) -> None:
    message, random = wanted(protocols[kind]), np.random.default_rng(5)
    made = stream(message, 1000)
    whole = said(message, made)
    good: list[Any] = []
    for number, each in enumerate(made):
        if number % 10 != 5:
            good.append(whole[number])
            continue
        spoilt, at = bytearray(each), int(random.integers(len(each)))
        if spoil == "drop":
            del spoilt[at]
        elif spoil == "add":
            spoilt.insert(at, int(random.integers(256)))
        else:
            spoilt[at] ^= 1 << int(random.integers(8))
        made[number] = bytes(spoilt)
    values, counts = split(taken(finder(message, protocols[kind]), b"".join(made)))
    # A byte that is added in front, or a blank in text, spoils nothing.
    spare = len(values) - len(good)
    assert 0 <= spare <= (40 if spoil == "add" else 8)
    assert {*map(key, good)} <= {*map(key, values)} <= {*map(key, whole)}
    assert 100 - spare <= counts[Counted.REFUSED] + spare <= 130
    if message.modulus:
        assert counts[Counted.LOST] == 100 - spare


@pytest.mark.parametrize("kind", KINDS)
def test_a_million_random_bytes_do_no_harm(protocols: dict[str, DeviceProtocol], kind: str) -> None:
    message, random = wanted(protocols[kind]), np.random.default_rng(9)
    search, kept = finder(message, protocols[kind]), list[int]()
    noise = random.bytes(1_000_000)
    assert split(taken(search, noise, 4096, kept))[0] == []
    assert max(kept) <= max(LONGEST, message.size)
    good = stream(message, 3)
    assert same(split(taken(search, b"\r\n" + b"".join(good)))[0], said(message, good))


@pytest.mark.parametrize("kind", KINDS)
def test_a_flood_of_beginnings_does_no_harm(protocols: dict[str, DeviceProtocol], kind: str) -> None:
    message = wanted(protocols[kind])
    for piece in (message.header, message.prefix, message.prefix + b"1", message.prefix + b"1.0,"):
        search, kept = finder(message, protocols[kind]), list[int]()
        assert split(taken(search, piece * 4000, 4096, kept))[0] == []
        assert max(kept) <= LONGEST + len(piece)
        good = stream(message, 3)
        found = split(taken(search, b"\r\n" + b"".join(good)))[0]
        assert same(found[-2:], said(message, good)[-2:])


def test_messages_of_other_kinds_are_counted_and_hide_nothing(protocols: dict[str, DeviceProtocol]) -> None:
    for kind in ("nmea", "bytes"):
        told = protocols[kind]
        one, other = told.messages.values()
        random = np.random.default_rng(2)
        mixed, count = [], 0
        for each in stream(one, 50):
            extra = int(random.integers(0, 3))
            mixed += [each]
            values = [1, 1, 1, 1, 1] if kind == "nmea" else [12.0]
            mixed += [encode(other, values)] * extra
            count += extra
        values, counts = split(taken(finder(one, told), b"".join(mixed)))
        assert len(values) == 50
        assert counts == {Counted.LOST: 0, Counted.REFUSED: 0, Counted.OTHER: count}


def test_lines_that_no_file_describes_are_others_if_their_checksum_is_right(
    protocols: dict[str, DeviceProtocol],
) -> None:
    message = protocols["nmea"].messages["depth"]
    lines = b"$GPVTG,1*6F\r\n$GPVTG,1*6E\r\n$GPTXT,hello world*38\r\n"
    good = stream(message, 2)
    found = split(taken(finder(message), good[0] + lines + good[1]))
    assert len(found[0]) == 2
    sealed = sum(_sealed(line) for line in lines.split(b"\r\n")[:-1])
    assert found[1] == {Counted.LOST: 0, Counted.REFUSED: 3 - sealed, Counted.OTHER: sealed}


def _sealed(line: bytes) -> bool:
    import pynmea2

    body, _, digits = line[1:].partition(b"*")
    return pynmea2.NMEASentence.checksum(body.decode()) == int(digits, 16)


def test_what_came_before_the_reader_is_no_damage(protocols: dict[str, DeviceProtocol]) -> None:
    for kind in KINDS:
        message = wanted(protocols[kind])
        one, two = stream(message, 2)
        for begin in range(1, len(one)):
            found = taken(finder(message, protocols[kind]), one[begin:] + two)
            assert Counted.REFUSED not in found and same(found, said(message, [two])), (kind, begin)


def test_gaps_in_the_numbers_are_lost_messages_and_a_restart_is_none(
    protocols: dict[str, DeviceProtocol],
) -> None:
    message = wanted(protocols["bytes"])
    made = stream(message, 1100)
    order = [0, 1, 4, 5, 995, 1003, 1003, 1004, *range(3)]
    values, counts = split(taken(finder(message), b"".join(made[number] for number in order)))
    assert len(values) == len(order)
    # 2 and 3; 5 to 995 is more than half of 1000; 996 to 1002; the second 1003 repeats the first.
    assert counts[Counted.LOST] == 2 + 7


def test_a_value_out_of_range_is_refused_and_the_next_one_counts(
    protocols: dict[str, DeviceProtocol],
) -> None:
    message = protocols["nmea"].messages["depth"]
    sealed = {
        value: b"$SDDPT,%s,*%02X\r\n" % (value, xor(b"SDDPT,%s," % value)) for value in (b"300", b"100")
    }
    found = taken(finder(message), b"".join(sealed.values()))
    assert (found[0], found[1][0]) == (Counted.REFUSED, 100.0)


def test_of_a_datagram_what_is_left_belongs_to_no_other(protocols: dict[str, DeviceProtocol]) -> None:
    for kind in KINDS:
        message = wanted(protocols[kind])
        search, good = finder(message, protocols[kind]), stream(message, 4)
        for datagram, values, refused in (
            (good[0], 1, 0),
            (good[1] + good[2], 2, 0),
            (good[0][:-2], 0, 1),
            (good[0][-2:], 0, 1),
            (good[3] + good[0][:9], 1, 1),
            (b"", 0, 0),
        ):
            received = bytearray(datagram)
            found, counts = split(list(search.take(received, is_whole=True)))
            assert (len(found), counts[Counted.REFUSED], bytes(received)) == (values, refused, b""), kind


def test_bytes_without_a_beginning_are_found_by_their_checksum(tmp_path: Path) -> None:
    text = """
quadvis: 1
name: bare
order: little
messages:
  pair:
    fields: [{name: a, type: i16}, {name: b, type: f32}]
    checksum: crc32
"""
    message = wanted(protocol(text, tmp_path))
    made = [encode(message, [number, number / 8]) for number in range(300)]
    data = b"\x01\x02\x03" + b"".join(made[:100]) + made[100][:5] + b"".join(made[101:])
    values, counts = split(taken(finder(message), data, 7))
    assert values == [(number, number / 8) for number in range(300) if number != 100]
    assert counts[Counted.REFUSED] == 1
    assert made[3] == struct.pack("<hfI", 3, 0.375, __import__("zlib").crc32(made[3][:6]))


# Not one wrong value in a million messages of which 1 % of the bytes have a wrong bit.


def wrong_values(message: ProtocolMessage, told: DeviceProtocol, count: int, seed: int) -> tuple[int, int]:
    """Return how many values were wrong, and how many messages were taken, of so many damaged ones."""
    random = np.random.default_rng(seed)
    several = 2000
    made = stream(message, several, seed)
    right = {*map(key, said(message, made))}
    search, received = finder(message, told), bytearray()
    data, wrong, good = b"".join(made), 0, 0
    for _ in range(count // several):
        spoilt = flipped(data, random)
        for begin in range(0, len(spoilt), 4096):
            received += spoilt[begin : begin + 4096]
            for found in search.take(received):
                if not isinstance(found, Counted):
                    good += 1
                    wrong += key(found) not in right
    return wrong, good


@pytest.mark.parametrize(
    ("kind", "count"),
    [
        ("text", 20_000),
        ("bytes", 20_000),
        pytest.param("text", 200_000, marks=pytest.mark.slow),
        pytest.param("text", 1_000_000, marks=pytest.mark.long),
        pytest.param("bytes", 200_000, marks=pytest.mark.slow),
    ],
)
def test_no_damaged_message_gives_a_wrong_value(
    protocols: dict[str, DeviceProtocol], kind: str, count: int
) -> None:
    wrong, good = wrong_values(wanted(protocols[kind]), protocols[kind], count, 11)
    assert wrong == 0
    assert 0.4 * count < good < 0.8 * count
