"""Tests of the block hardware.sbus_in."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from quadvis.block import Counted
from quadvis.errors import RunError
from quadvis_blocks.hardware._sbus import encode
from quadvis_blocks.hardware.sbus_in import SbusIn
from tests.blocks.hardware.pty_pair import filled
from tests.blocks.hardware.receivers import Receiver, counts, given, messages, receiving, values
from tests.blocks.hardware.sbus_frames import CENTRE, SWITCHES

TWO = given([1, 3], "stick throttle")
ON = CENTRE[:1]  # of the frame that follows
GOOD = 5 * CENTRE + ON  # the link is good, and a frame has begun


@pytest.fixture
def reader() -> Iterator[Receiver]:
    with receiving(SbusIn, **TWO) as made:
        yield made


def frame(one: int, three: int, flags: int = 0) -> bytes:
    return encode(counts(c1=one, c3=three), flags)


def told(row: dict[str, Any]) -> list[Any]:
    return [row[name] for name in ("age", "lost", "refused", "command", "good", "failsafe")]


def test_the_newest_frame_counts_and_ages(reader: Receiver) -> None:
    assert repr(told(reader.step())) == "[nan, 0, 0, [-0.5, -820.0], False, False]"
    assert told(reader.step(GOOD)) == [0.0, 4, 0, [0.0, 0.0], True, False]
    row = told(reader.step(CENTRE[1:] + frame(172, 1811) + frame(1811, 1000)))
    assert row == [0.0, 6, 0, [819.0, 8.0], True, False]
    assert told(reader.step()) == [pytest.approx(0.01), 6, 0, [819.0, 8.0], True, False]
    row = told(reader.step(frame(992, 992)[:7]))
    assert row == [pytest.approx(0.02), 6, 0, [819.0, 8.0], True, False]
    assert told(reader.step(frame(992, 992)[7:])) == [0.0, 6, 0, [0.0, 0.0], True, False]


def test_flags_of_the_receiver_count(reader: Receiver) -> None:
    reader.step(GOOD)
    reader.step(frame(1000, 1100)[1:])
    held = [pytest.approx(0.01), 5, 0, [8.0, 108.0], True, False]
    assert told(reader.step(frame(1000, 1000, 4))) == held
    # The receiver has lost the pilot, and so have we; the values that it invents do not count.
    assert told(reader.step(frame(1000, 1500, 8)))[3:] == [[8.0, 108.0], True, True]
    assert told(reader.step(frame(1000, 1500, 8)))[3:] == [[-0.5, -820.0], False, True]
    assert told(reader.step(4 * frame(992, 992)))[3:] == [[-0.5, -820.0], False, False]
    assert told(reader.step(frame(992, 992)))[3:] == [[0.0, 0.0], True, False]


def test_channels_far_beyond_the_ends_refuse_a_frame(reader: Receiver) -> None:
    reader.step(GOOD)
    reader.step(CENTRE[1:])
    assert told(reader.step(frame(0, 992)))[:4] == [pytest.approx(0.01), 4, 1, [0.0, 0.0]]
    assert told(reader.step(frame(100, 1890) + ON))[:4] == [0.0, 4, 1, [-892.0, 898.0]]
    # Zeros in channels that are not in use are no harm.
    assert told(reader.step(SWITCHES[1:]))[:4] == [0.0, 4, 1, [0.0, -640.0]]


@pytest.mark.parametrize("spoil", ["drop", "add", "flip"])
def test_a_byte_too_few_too_many_or_wrong_costs_one_frame(spoil: str) -> None:
    random = np.random.default_rng(3)
    for _ in range(80):
        ends = [int(count) for count in random.integers(172, 1812, 24)]
        wanted = list(zip(ends[::2], ends[1::2], strict=True))
        frames = [frame(one, three) for one, three in wanted]
        at = int(random.integers(25))
        spoilt = bytearray(frames[5])
        if spoil == "drop":
            del spoilt[at]
        elif spoil == "add":
            spoilt.insert(at, int(random.integers(256)))
        else:
            at = (0, 24)[at % 2]  # no checksum finds a wrong channel
            spoilt[at] ^= 1 << int(random.integers(3) + 4 * (at == 0))
        sent = b"".join([*frames[:5], bytes(spoilt), *frames[6:], ON])
        found = values(messages(SbusIn, sent, piece=7, **TWO))
        shown = [(one - 992, three - 992) for one, three in wanted]
        assert found[:5] == shown[:5]
        assert found[-6:] == shown[-6:]


@pytest.mark.slow
def test_of_10000_frames_each_tenth_without_a_byte_all_others_come_and_none_is_wrong() -> None:
    random = np.random.default_rng(4)
    every = list(range(1, 17))
    sent, wanted = bytearray(), []
    for number in range(10_000):
        made = [int(count) for count in random.integers(172, 1812, 16)]
        piece = bytearray(encode(made))
        if number % 10 == 4:
            del piece[int(random.integers(25))]
        else:
            wanted.append(tuple(count - 992 for count in made))
        sent += piece
    found = messages(SbusIn, bytes(sent) + ON, piece=997, **given(every, " ".join(["stick"] * 16)))
    assert values(found) == wanted
    assert found.count(Counted.REFUSED) == 1000


def test_a_million_random_bytes_do_no_harm_and_the_next_frames_come() -> None:
    random = np.random.default_rng(5)
    noise = random.integers(0, 256, 1_000_000, np.uint8).tobytes()
    found = messages(SbusIn, noise + 3 * frame(1000, 1000) + ON, piece=4000, **TWO)
    assert values(found)[-2:] == [(8, 8)] * 2


def test_after_a_long_pause_old_frames_do_not_count(reader: Receiver) -> None:
    reader.step(GOOD)
    os.set_blocking(reader.peer, False)
    filled(reader.peer, reader.port, CENTRE[1:] + 200 * frame(1000, 1000))
    row = reader.step()
    assert (row["age"], row["command"]) == (pytest.approx(0.01), [0.0, 0.0])
    assert row["lost"] > 100


def test_what_came_before_a_pause_makes_no_link_good(reader: Receiver) -> None:
    """Else the commands of a loss would count as the pilot's: full stop in the air."""
    reader.step()
    os.set_blocking(reader.peer, False)
    filled(reader.peer, reader.port, 200 * CENTRE)
    row = reader.step()
    assert (row["good"], row["heard"], row["command"]) == (False, False, [-0.5, -820.0])
    assert row["lost"] > 100
    reader.step(2 * GOOD)
    row = reader.step(2 * GOOD)
    assert (row["good"], row["command"]) == (True, [0.0, 0.0])


def test_a_port_that_is_lost_lets_the_age_grow_and_is_reported_at_the_end() -> None:
    with (
        pytest.raises(RunError, match=r"block 'block', t = \S+ s: cannot close: .*gone"),
        receiving(SbusIn, **TWO) as made,
    ):
        made.step(GOOD)
        made.unplug()
        assert [made.step()["age"], made.step()["age"]] == [pytest.approx(0.01), pytest.approx(0.02)]


def test_a_cable_outside_a_real_time_run_and_a_missing_port_are_refused() -> None:
    block = SbusIn(**TWO)
    with pytest.raises(Exception, match="pty:rc is a cable, and only a real-time run makes cables"):
        block.open()
    missing = SbusIn(**{**TWO, "port": "/dev/no such"})
    with pytest.raises(Exception, match="port '/dev/no such' is missing; plug the device in"):
        missing.open()
