"""Tests of the block hardware.sbus_in."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from quadvis.block import Counted
from quadvis.errors import RunError
from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period
from quadvis_blocks.hardware._sbus import encode
from quadvis_blocks.hardware.sbus_in import SbusIn
from tests.blocks.hardware.sbus_frames import CENTRE, SWITCHES
from tests.quadvis.realtime.ptys import arrive

NAMES = ("age", "lost", "refused", "command", "failsafe")


class Reader:
    """The block at the end of a pty, and its peer."""

    def __init__(self, **given: Any) -> None:
        self.peer, self.port = os.openpty()
        ends = {"lowest": [-820.0, -820.0], "highest": [819.0, 819.0]}
        self.block = SbusIn(**{"port": os.ttyname(self.port), "channels": [1, 3], **ends, **given})
        self.engine = alone(self.block, {}, {"n": 2}, parse_period("100 Hz"))

    def step(self, came: bytes = b"") -> Any:
        if came:
            arrive(self.peer, self.port, came)
        self.engine.run(1)
        found = {name: self.engine.read(ALONE, name) for name in NAMES}
        return [np.asarray(found[name]).tolist() for name in NAMES]


@pytest.fixture
def reader() -> Iterator[Reader]:
    made = Reader()
    with made.engine:
        yield made
    os.close(made.peer)
    os.close(made.port)


def frame(one: int, three: int, flags: int = 0) -> bytes:
    return encode([one, 992, three, *[992] * 13], flags)


def test_the_newest_frame_counts_and_ages(reader: Reader) -> None:
    assert repr(reader.step()) == "[nan, 0, 0, [nan, nan], False]"
    assert reader.step(CENTRE + CENTRE[:1]) == [0.0, 0, 0, [0.0, 0.0], False]
    assert reader.step(CENTRE[1:] + frame(172, 1811) + frame(1811, 1000)) == [0.0, 2, 0, [819.0, 8.0], False]
    assert reader.step() == [pytest.approx(0.01), 2, 0, [819.0, 8.0], False]
    assert reader.step(frame(992, 992)[:7]) == [pytest.approx(0.02), 2, 0, [819.0, 8.0], False]
    assert reader.step(frame(992, 992)[7:]) == [0.0, 2, 0, [0.0, 0.0], False]


def test_flags_of_the_receiver_count(reader: Reader) -> None:
    reader.step(CENTRE + CENTRE[:1])
    assert reader.step(CENTRE[1:]) == [0.0, 0, 0, [0.0, 0.0], False]
    assert reader.step(frame(1000, 1000, 4)) == [pytest.approx(0.01), 1, 0, [0.0, 0.0], False]
    assert reader.step(frame(172, 992, 8)) == [0.0, 1, 0, [-820.0, 0.0], True]
    assert reader.step(frame(992, 992)) == [0.0, 1, 0, [0.0, 0.0], False]


def test_channels_far_beyond_the_ends_refuse_a_frame(reader: Reader) -> None:
    reader.step(CENTRE + CENTRE[:1])
    reader.step(CENTRE[1:])
    assert reader.step(frame(0, 992)) == [pytest.approx(0.01), 0, 1, [0.0, 0.0], False]
    assert reader.step(frame(100, 1890)) == [0.0, 0, 1, [-892.0, 898.0], False]
    assert reader.step(SWITCHES) == [0.0, 0, 1, [0.0, -640.0], False]  # zeros in channels that are not in use


def messages(data: bytes) -> list[Any]:
    """Return what the decoder gives for bytes that come one by one."""
    block = SbusIn(port="pty:rc", channels=[1, 3], lowest=[-820.0] * 2, highest=[819.0] * 2)
    block._in_step = False
    received, found = bytearray(), []
    for byte in data:
        received.append(byte)
        found += list(block.decode(received))
    return found


@pytest.mark.parametrize("spoil", ["drop", "add", "flip"])
def test_a_byte_too_few_too_many_or_wrong_costs_one_frame(spoil: str) -> None:
    random = np.random.default_rng(3)
    for _ in range(300):
        counts = [int(count) for count in random.integers(172, 1812, 24)]
        frames = [frame(one, three) for one, three in zip(counts[::2], counts[1::2], strict=True)]
        at = int(random.integers(25))
        spoilt = bytearray(frames[5])
        if spoil == "drop":
            del spoilt[at]
        elif spoil == "add":
            spoilt.insert(at, int(random.integers(256)))
        else:
            at = (0, 24)[at % 2]  # no checksum finds a wrong channel
            spoilt[at] ^= 1 << int(random.integers(3) + 4 * (at == 0))
        wanted = [(one - 992.0, three - 992.0) for one, three in zip(counts[::2], counts[1::2], strict=True)]
        found = messages(b"".join([*frames[:5], bytes(spoilt), *frames[6:], CENTRE[:1]]))
        values = [tuple(np.rint(each[0]).tolist()) for each in found if not isinstance(each, Counted)]
        assert values[:5] == wanted[:5]
        assert values[-6:] == wanted[-6:]


def test_after_a_long_pause_old_frames_do_not_count(reader: Reader) -> None:
    reader.step(CENTRE + CENTRE[:1])
    os.set_blocking(reader.peer, False)
    backlog = CENTRE[1:] + 200 * frame(1000, 1000)
    written = 0
    try:
        while written < len(backlog):
            written += os.write(reader.peer, backlog[written:])
    except BlockingIOError:
        pass
    age, lost, _, command, _ = reader.step()
    assert (age, command) == (pytest.approx(0.01), [0.0, 0.0])
    assert lost > 100


def test_a_port_that_is_lost_lets_the_age_grow_and_is_reported_at_the_end() -> None:
    reader = Reader()
    with pytest.raises(RunError, match=r"block 'block', t = \S+ s: cannot close: .*gone"), reader.engine:
        reader.step(CENTRE + CENTRE[:1])
        os.close(reader.peer)
        assert [reader.step()[0], reader.step()[0]] == [pytest.approx(0.01), pytest.approx(0.02)]
    os.close(reader.port)


def test_a_cable_outside_a_real_time_run_and_a_missing_port_are_refused() -> None:
    block = SbusIn(port="pty:rc", channels=[1], lowest=[0.0], highest=[1.0])
    with pytest.raises(Exception, match="pty:rc is a cable, and only a real-time run makes cables"):
        block.open()
    with (
        pytest.raises(RunError, match="port '/dev/no such' is missing; plug the device in"),
        Reader(port="/dev/no such").engine,
    ):
        pass
