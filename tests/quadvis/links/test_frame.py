"""Frames: they come whole through any chunks, and nothing is accepted that is not whole."""

from __future__ import annotations

import struct
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.links.frame import Decoder, encode, longest, stuffed, unstuffed
from quadvis.links.message import Message, MessageSignal
from quadvis.units import Unit
from tests.damage import damaged


def message(count: int = 1, name: str = "y") -> Message:
    shape = (count,) if count > 1 else ()
    return Message((MessageSignal(name, "a", name, "float64", shape, (Unit(),) * count, True, 0.0),))


ONE = message()


@given(st.binary(max_size=700))
def test_stuffed_bytes_have_no_zeros_and_come_back(data: bytes) -> None:
    made = stuffed(data)
    assert 0 not in made
    assert unstuffed(made) == data
    assert len(made) <= len(data) + len(data) // 254 + 1


# The examples of the article on COBS in Wikipedia.
@pytest.mark.parametrize(
    ("data", "coded"),
    [
        ("00", "01 01"), ("00 00", "01 01 01"), ("00 11 00", "01 02 11 01"),
        ("11 22 00 33", "03 11 22 02 33"), ("11 22 33 44", "05 11 22 33 44"),
        ("11 00 00 00", "02 11 01 01 01"),
    ],
)  # fmt: skip
def test_the_published_examples(data: str, coded: str) -> None:
    assert stuffed(bytes.fromhex(data)) == bytes.fromhex(coded)


def chopped(data: bytes, cuts: list[int]) -> list[bytes]:
    places = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [data[start:end] for start, end in pairwise(places)]


@given(
    st.lists(st.floats(allow_nan=False), min_size=1, max_size=8), st.lists(st.integers(0, 10**6), max_size=30)
)
def test_frames_come_whole_through_any_chunks(values: list[float], cuts: list[int]) -> None:
    data = b"".join(encode(ONE, n, 10 * n, ONE.pack((value,))) for n, value in enumerate(values))
    decoder = Decoder(ONE)
    found = [arrival for piece in chopped(data, cuts) for arrival in decoder.take(piece)]
    assert [(each.stamp, ONE.unpack(each.payload)[0]) for each in found] == [
        (10 * n, value) for n, value in enumerate(values)
    ]
    assert (decoder.lost, decoder.refused) == (0, 0)


@pytest.mark.faults
@given(st.binary(max_size=400), st.lists(st.integers(0, 10**6), max_size=5))
def test_noise_is_never_a_frame_and_the_next_frame_but_one_comes(noise: bytes, cuts: list[int]) -> None:
    frames = [encode(ONE, n, n, ONE.pack((float(n),))) for n in range(2)]
    decoder = Decoder(ONE)
    data = noise + b"".join(frames)
    found = [arrival.stamp for piece in chopped(data, cuts) for arrival in decoder.take(piece)]
    assert found in ([0, 1], [1])


def test_a_frame_of_every_length_is_as_long_as_is_stated() -> None:
    for count in (1, 2, 29, 30, 31, 32, 64, 100):
        made = message(count)
        full = encode(made, 1, 2**62 - 1, b"\xff" * made.size)
        assert len(full) <= longest(made)
        assert [each.payload for each in Decoder(made).take(full)] == [b"\xff" * made.size]


@given(st.integers(0, 10**6), st.integers(1, 255))
def test_no_single_wrong_byte_is_accepted(place: int, flip: int) -> None:
    made = bytearray(encode(ONE, 5, 77, ONE.pack((0.1,))))
    made[place % (len(made) - 1)] ^= flip
    decoder = Decoder(ONE)
    assert list(decoder.take(bytes(made))) == []
    assert decoder.refused >= 1
    after = encode(ONE, 6, 78, ONE.pack((0.2,)))
    assert [each.stamp for each in decoder.take(after)] == [78]


def test_frames_of_another_layout_are_refused() -> None:
    decoder = Decoder(ONE)
    assert list(decoder.take(encode(message(name="z"), 0, 0, ONE.pack((1.0,))))) == []
    assert decoder.refused == 1


def test_what_is_missing_is_counted_by_the_sequence_numbers() -> None:
    decoder = Decoder(ONE)
    sent = [0, 1, 4, 5, 65534, 65535, 65536, 65538]
    found = [
        arrival.stamp
        for number in sent
        for arrival in decoder.take(encode(ONE, number, number, ONE.pack((0.0,))))
    ]
    assert found == sent
    # From 5 to 65534 the numbers go back as far as one can see: the sender may have begun anew.
    assert decoder.lost == 2 + 1


def sent(*numbers: tuple[int, int]) -> bytes:
    """Return frames with these sequence numbers and stamps."""
    return b"".join(encode(ONE, number, stamp, ONE.pack((0.0,))) for number, stamp in numbers)


def test_a_frame_that_others_have_overtaken_is_ignored() -> None:
    decoder = Decoder(ONE)
    found = decoder.take(sent((0, 10), (2, 30), (1, 20), (2, 30), (3, 40)))
    assert [each.stamp for each in found] == [10, 30, 40]
    assert (decoder.lost, decoder.refused) == (1, 0)


@pytest.mark.parametrize("before", [(40_000, 10), (40_000, 10**12), (100, 10**12)])
def test_a_sender_that_begins_anew_is_followed(before: tuple[int, int]) -> None:
    decoder = Decoder(ONE)
    assert [each.stamp for each in decoder.take(sent(before, (0, 20), (1, 30)))] == [before[1], 20, 30]


def test_endless_noise_takes_no_memory() -> None:
    decoder = Decoder(ONE)
    for _ in range(1000):
        assert list(decoder.take(b"\x55" * 1000)) == []
    assert len(decoder._rest) <= longest(ONE)
    assert list(decoder.take(b"\0")) == [] and decoder.refused == 1


KINDS = ("flip", "drop", "insert")


def through_damage(frames: int, seed: int) -> float:
    """Send frames through a line that spoils 1 % of the bytes: nothing wrong is accepted, most come.

    Return the share that comes.
    """
    random = np.random.default_rng(seed)
    decoder, delivered, wrong = Decoder(ONE), 0, 0
    for begin in range(0, frames, 10_000):
        data = b"".join(
            encode(ONE, n, n, struct.pack("<d", n * 0.1)) for n in range(begin, min(begin + 10_000, frames))
        )
        for arrival in decoder.take(damaged(data, 0.01, random)):
            delivered += 1
            wrong += arrival.payload != struct.pack("<d", arrival.stamp * 0.1)
    assert wrong == 0
    assert delivered >= 0.75 * frames
    assert decoder.lost + delivered >= frames - 20
    return delivered / frames


def test_nothing_wrong_is_accepted_from_a_bad_line() -> None:
    through_damage(4000, 1)


@pytest.mark.slow
def test_nothing_wrong_is_accepted_of_a_million_frames() -> None:
    through_damage(1_000_000, 2)


@pytest.mark.parametrize("kind", KINDS)
def test_after_one_error_at_most_two_frames_are_missing(kind: str) -> None:
    frames = [encode(ONE, n, n, struct.pack("<d", n * 0.1)) for n in range(8)]
    data, random = b"".join(frames), np.random.default_rng(3)
    for place in range(len(frames[0]) * 3):
        for new in (0, int(random.integers(1, 256))):
            spoilt = {
                "flip": data[:place] + bytes([data[place] ^ (new or 0x80)]) + data[place + 1 :],
                "drop": data[:place] + data[place + 1 :],
                "insert": data[:place] + bytes([new]) + data[place:],
            }[kind]
            found = [each.stamp for each in Decoder(ONE).take(spoilt)]
            assert len(found) >= 6 and found == sorted(found)
            missing = sorted(set(range(8)) - set(found))
            assert not missing or missing[-1] - missing[0] <= 1
