"""Packets found in bytes: every good one, none that is damaged; whole ones that are not ours by number."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import common as version_1

from quadvis_blocks.mavlink._dialect import dialect
from quadvis_blocks.mavlink._packets import LooseMessage, packet
from quadvis_blocks.mavlink._scanner import Packet, PacketScanner
from tests.blocks.mavlink.pymavlink_peer import Wire, angles, attitude, speaker
from tests.stages import mostly_slow

COMMON = dialect("common")
ATTITUDE = COMMON.names["ATTITUDE"]


def numbers(found: list[Packet]) -> list[int]:
    """Return the numbers of attitudes; AssertionError if one has wrong values."""
    read = []
    for each in found:
        fields = ATTITUDE.unpack(each.payload)
        number = fields["time_boot_ms"]
        wanted = np.float32([*angles(number), 0.1, 0.2, 0.3])
        values = [fields[name] for name in ("roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")]
        assert np.float32(values).tolist() == wanted.tolist(), f"wrong values: {fields}"
        read.append(number)
    return read


def scanned(data: bytes, *, piece: int = 1 << 20, scanner: PacketScanner | None = None) -> list[Packet]:
    scanner, received, found = scanner or PacketScanner(COMMON.numbers), bytearray(), []
    for begin in range(0, len(data), piece):
        received += data[begin : begin + piece]
        found += list(scanner.take(received))
    return found


@given(st.lists(st.integers(0, 10**6), min_size=1, max_size=8), st.integers(1, 100))
def test_all_packets_come_in_pieces_of_any_length(sent: list[int], piece: int) -> None:
    mav = speaker()
    data = b"".join(attitude(mav, number) for number in sent)
    scanner = PacketScanner(COMMON.numbers)
    found = scanned(data, piece=piece, scanner=scanner)
    assert numbers(found) == sent
    assert scanner.counts.damaged == 0
    assert {each.sender for each in found} == {(1, 1)}


def test_packets_that_are_missing_are_counted_by_their_sender() -> None:
    one, other = speaker(1, 1), speaker(2, 1)
    one.seq = 253
    sent = [attitude(one, number) for number in range(8)]
    between = [attitude(other, number) for number in range(8)]
    found = scanned(sent[0] + between[0] + between[1] + sent[5] + between[2] + sent[7])
    assert [each.missing for each in found] == [0, 0, 0, 4, 0, 1]


@pytest.mark.parametrize("spoil", ["drop", "add", "flip"])
def test_a_byte_too_few_too_many_or_wrong_costs_one_packet(spoil: str) -> None:
    random = np.random.default_rng(3)
    mav = speaker()
    for _ in range(150):
        sent = [attitude(mav, number) for number in range(11)]
        spoilt = bytearray(sent[5])
        at = int(random.integers(len(spoilt)))
        if spoil == "drop":
            del spoilt[at]
        elif spoil == "add":
            spoilt.insert(at, int(random.integers(256)))
        else:
            spoilt[at] ^= 1 << int(random.integers(8))
        scanner = PacketScanner(COMMON.numbers)
        data = b"".join([*sent[:5], bytes(spoilt), *sent[6:]])
        found = numbers(scanned(data, piece=50, scanner=scanner))
        assert [each for each in found if each != 5] == [0, 1, 2, 3, 4, 6, 7, 8, 9, 10]
        assert scanner.counts.damaged == 1
        assert not scanner.counts.unknown and not scanner.counts.differs


def test_a_good_packet_is_not_held_up_by_a_damaged_length() -> None:
    mav = speaker()
    spoilt = bytearray(attitude(mav, 1))
    spoilt[1] = 255
    assert numbers(scanned(bytes(spoilt) + attitude(mav, 2))) == [2]


def test_packets_inside_another_one_do_not_count() -> None:
    inside = speaker()
    outside = speaker(9, 9)
    outside.tunnel_send(1, 1, 0, 100, list((attitude(inside, 5) + attitude(inside, 6)).ljust(128, b"\0")))
    (tunnel,) = outside.file.packets
    found = scanned(tunnel + attitude(inside, 7), piece=60)
    assert [each.number for each in found] == [COMMON.names["TUNNEL"].number, ATTITUDE.number]


def test_a_changed_list_of_fields_is_counted_by_number_and_is_no_damage() -> None:
    other = [
        packet(LooseMessage(ATTITUDE.number, 77, ATTITUDE.pack(time_boot_ms=number)), number, 1, 1)
        for number in range(10)
    ]
    scanner = PacketScanner(COMMON.numbers)
    assert scanned(b"".join(other), scanner=scanner) == []
    assert scanner.counts.differs == {ATTITUDE.number: 10}
    assert scanner.counts.damaged == 0 and not scanner.counts.unknown


def test_numbers_that_the_dialect_has_not_are_counted_apart() -> None:
    strange = [packet(LooseMessage(54321, 9, b"hello"), number, 1, 1) for number in range(10)]
    scanner = PacketScanner(COMMON.numbers)
    data = b"".join(strange) + attitude(speaker(), 3)
    assert numbers(scanned(data, piece=7, scanner=scanner)) == [3]
    assert scanner.counts.unknown == {54321: 10}
    assert scanner.counts.damaged == 0 and not scanner.counts.differs


def test_damage_that_looks_like_another_definition_is_damage_once_a_good_packet_has_come() -> None:
    scanner = PacketScanner(COMMON.numbers)
    lookalike = packet(LooseMessage(ATTITUDE.number, 77, ATTITUDE.pack(time_boot_ms=3)), 0, 1, 1)
    scanned(lookalike + lookalike, scanner=scanner)
    assert scanner.counts.differs == {ATTITUDE.number: 2}
    assert numbers(scanned(attitude(speaker(), 1) + lookalike, scanner=scanner)) == [1]
    assert not scanner.counts.differs
    assert scanner.counts.damaged == 3


def test_version_1_is_no_packet_and_its_heartbeats_are_counted() -> None:
    mav = version_1.MAVLink(Wire(), srcSystem=1, srcComponent=1)
    for _ in range(3):
        mav.heartbeat_send(2, 3, 0, 0, 4)
    scanner = PacketScanner(COMMON.numbers)
    for each in mav.file.packets:
        assert scanned(each, scanner=scanner) == []
    assert scanner.counts.version_1 == 3


def test_random_bytes_give_nothing_and_cost_no_memory() -> None:
    scanner, received = PacketScanner(COMMON.numbers), bytearray()
    random = np.random.default_rng(1)
    for _ in range(100):
        received += random.bytes(2000)
        assert list(scanner.take(received)) == []
        assert len(received) <= 280
    assert len(scanner._suspects) <= 1001
    assert numbers(scanned(attitude(speaker(), 8), scanner=scanner)) == [8]


def flipped(count: int, seed: int) -> tuple[int, PacketScanner]:
    """Send attitudes of which each byte is flipped with a probability of 1 %; return how many came."""
    random = np.random.default_rng(seed)
    mav, scanner, received, came = speaker(), PacketScanner(COMMON.numbers), bytearray(), 0
    for begin in range(0, count, 1000):
        data = np.frombuffer(
            b"".join(attitude(mav, number) for number in range(begin, begin + 1000)), np.uint8
        )
        hit = random.random(len(data)) < 0.01
        bits = (1 << random.integers(0, 8, len(data))).astype(np.uint8)
        received += np.where(hit, data ^ bits, data).tobytes()
        came += len(numbers(list(scanner.take(received))))
    return came, scanner


def test_flipped_bits_give_no_wrong_value() -> None:
    came, scanner = flipped(20_000, 7)
    assert 0.6 * 20_000 < came < 0.8 * 20_000  # 0.99 ** 40 is 0.67
    assert sum(scanner.counts.differs.values()) + sum(scanner.counts.unknown.values()) < 10


@pytest.mark.parametrize("count", mostly_slow([200_000, 1_000_000], quick=0, slow=1))
def test_of_many_messages_with_flipped_bits_none_gives_a_wrong_value(count: int) -> None:
    came, _ = flipped(count, 11)
    assert 0.6 * count < came < 0.8 * count
