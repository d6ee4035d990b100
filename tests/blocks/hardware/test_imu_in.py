"""An inertial unit that sends the frames of a link: whole ones count, and nothing that is damaged."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import Counted
from quadvis.links.frame import Decoder, encode
from quadvis_blocks.hardware.imu_in import ImuIn, message_of

MESSAGE = message_of("craft/imu")


def frames(values: list[tuple[list[float], float, float]]) -> list[bytes]:
    """Return the frames of gyro, pitch and roll."""
    return [encode(MESSAGE, number, number * 10**7, MESSAGE.pack(each)) for number, each in enumerate(values)]


def unit() -> ImuIn:
    """Return the device without its port, as a pair of ptys is not what is tested here."""
    made = ImuIn(port="pty:imu")
    made._decoder = Decoder(MESSAGE)
    return made


def decoded(data: bytes, piece: int) -> list[object]:
    made, received, found = unit(), bytearray(), []
    for begin in range(0, len(data), piece):
        received += data[begin : begin + piece]
        found += list(made.decode(received))
    return found


@given(
    st.lists(st.tuples(*[st.floats(-10, 10)] * 5), min_size=1, max_size=8),
    st.integers(1, 60),
)
def test_each_frame_comes_as_it_was_sent_in_pieces_of_any_length(
    sent: list[tuple[float, ...]], piece: int
) -> None:
    data = b"".join(frames([(list(each[:3]), each[3], each[4]) for each in sent]))
    found = decoded(data, piece)
    assert [(*rates, pitch, roll) for roll, pitch, rates in found] == sent  # type: ignore[misc]


def test_a_frame_that_is_damaged_or_missing_or_not_finite_is_counted() -> None:
    good = frames([([0.1, 0.2, 0.3], 0.4, 0.5)] * 6)
    spoilt = bytearray(good[1])
    spoilt[20] ^= 0x10
    endless = encode(MESSAGE, 6, 10**9, MESSAGE.pack(([np.nan, 0.0, 0.0], 0.0, 0.0)))
    found = decoded(good[0] + bytes(spoilt) + good[2] + good[5] + endless, 1000)
    values = [each for each in found if not isinstance(each, Counted)]
    assert len(values) == 3 and values[0][0] == 0.5 and values[0][1] == 0.4  # type: ignore[index]
    assert found.count(Counted.REFUSED) == 2
    assert found.count(Counted.LOST) == 3  # the spoilt one, and two that never came


def test_frames_of_another_sender_are_refused() -> None:
    other = message_of("bench/imu")
    frame = encode(other, 0, 0, other.pack(([0.0] * 3, 0.0, 0.0)))
    assert decoded(frame, 1000) == [Counted.REFUSED]
