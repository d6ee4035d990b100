"""Messages: whatever the signals hold comes back from the bytes, and bytes of another length are refused."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import Frame
from quadvis.links.message import Message, MessageSignal
from quadvis.units import Unit

FLOATS = st.floats(allow_nan=True)
WHOLE = st.integers(-(2**63), 2**63 - 1)


def signal(name: str, scalar: str, shape: tuple[int, ...] = ()) -> MessageSignal:
    return MessageSignal(name, "block", name, scalar, shape, (Unit(),), True, 0)


ALL = Message((
    signal("a", "float64"), signal("b", "float64", (2, 3)), signal("c", "int64"), signal("d", "bool"),
    signal("e", "bool", (5,)), signal("f", "int64", (2,)),
))  # fmt: skip


@given(
    FLOATS, st.lists(FLOATS, min_size=6, max_size=6), WHOLE, st.booleans(),
    st.lists(st.booleans(), min_size=5, max_size=5), st.lists(WHOLE, min_size=2, max_size=2),
)  # fmt: skip
def test_what_is_packed_comes_back_to_the_bit(a, b, c, d, e, f) -> None:
    values = (a, np.reshape(b, (2, 3)), c, d, np.array(e), np.array(f, np.int64))
    data = ALL.pack(values)
    assert len(data) == ALL.size == 8 + 48 + 8 + 1 + 5 + 16
    for value, found in zip(values, ALL.unpack(data), strict=True):
        np.testing.assert_array_equal(np.asarray(found), np.asarray(value))
        assert np.asarray(found).dtype == np.asarray(value).dtype
    assert ALL.pack(ALL.unpack(data)) == data


def test_the_layout_is_little_endian_and_without_gaps() -> None:
    message = Message((signal("a", "bool"), signal("b", "float64"), signal("c", "int64")))
    assert message.pack((True, 1.5, -2)) == struct.pack("<?dq", True, 1.5, -2)


def test_a_picture_comes_back_with_its_stamp_and_number() -> None:
    pixels = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    message = Message((signal("n", "int64"), signal("picture", "frame")))
    data = message.pack((7, Frame(pixels, 0.25, 4)))
    assert len(data) == message.room((2, 3)) == message.size + 18
    number, frame = message.unpack(data)
    assert (number, frame.stamp, frame.sequence) == (7, 0.25, 4)
    np.testing.assert_array_equal(frame.pixels, pixels)
    none = message.unpack(message.pack((0, Frame.none())))[1]
    assert none.pixels.size == 0 and math.isnan(none.stamp) and none.sequence == 0


@pytest.mark.parametrize(
    "pixels",
    [
        np.zeros((4, 6), np.uint8),
        np.zeros((4, 6, 1), np.uint8),
        np.full((4, 6, 3), np.nan),
        np.zeros(7, np.uint8),
    ],
    ids=["grey", "one channel", "float64", "a row"],
)
def test_a_picture_that_is_none_travels_without_pixels(pixels: np.ndarray) -> None:
    message = Message((signal("picture", "frame"), signal("n", "int64")))
    frame, number = message.unpack(message.pack((Frame(pixels, 0.25, 4), 7)))
    assert (frame.pixels.shape, frame.stamp, frame.sequence, number) == ((0, 0, 3), 0.25, 4, 7)


@pytest.mark.parametrize("wrong", [-1, 1])
def test_bytes_of_another_length_are_refused(wrong: int) -> None:
    with pytest.raises(ValueError):
        ALL.unpack(bytes(ALL.size + wrong))


def test_other_layouts_have_other_checks() -> None:
    names = [Message((signal("a", "float64"),)), Message((signal("b", "float64"),)), ALL]
    assert len({message.check for message in names}) == 3
