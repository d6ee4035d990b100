"""Cables of ptys: bytes come out when a line would deliver them, and unchanged."""

from __future__ import annotations

import multiprocessing
import os
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.machine.serial_port import Line, close_port, open_port, read_waiting
from quadvis.realtime.cables import Cable, Cables, Lane
from tests.processes import gone, wait_for

SBUS = Line(100_000, parity="even", stop_bits=2)
BYTE = 120_000  # ns

pieces = st.lists(
    st.tuples(st.integers(0, 10**7), st.binary(min_size=1, max_size=40)), min_size=1, max_size=8
)


@given(pieces)
def test_each_byte_comes_out_when_its_last_bit_would(given_pieces: list[tuple[int, bytes]]) -> None:
    lane, now, free = Lane(SBUS), 0, 0
    wanted, data = [], b""
    for after, piece in given_pieces:
        now += after
        lane.put(now, piece)
        data += piece
        for _ in piece:
            free = max(free, now) + BYTE
            wanted.append(free)
    taken = b""
    for index, instant in enumerate(wanted):
        taken += lane.take(instant - 1)
        assert len(taken) == index
        taken += lane.take(instant)
        assert len(taken) == index + 1
    assert taken == data
    assert (lane.count, lane.next(free)) == (0, None)


def test_a_lane_says_when_to_look_again() -> None:
    lane = Lane(SBUS)
    lane.put(1000, bytes(2))
    assert lane.next(1000) == 1000 + 2 * BYTE
    lane.put(1000, bytes(98))
    assert lane.next(1000) == 1000 + 500_000
    lane.take(1000 + 99 * BYTE)
    assert lane.next(1000 + 99 * BYTE) == 1000 + 100 * BYTE


@pytest.mark.skipif(sys.platform != "linux", reason="ptys are Linux's")
def test_a_cable_carries_bytes_both_ways_and_ends_with_its_supervisor() -> None:
    cables = Cables(multiprocessing.get_context("spawn"), [Cable("one", SBUS), Cable("two", SBUS)], 0)
    cables.start()
    cables.make()
    try:
        ends = [open_port(path, SBUS) for name in ("one", "two") for path in cables.ends[name]]
        data = [os.urandom(300) for _ in ends]
        for end, sent in zip(ends, data, strict=True):
            os.write(end, sent)
        came = [b""] * 4

        def all_came() -> bool:
            for number, end in enumerate(ends):
                came[number] += read_waiting(end)
            return all(len(each) >= 300 for each in came)

        wait_for(all_came)
        assert came == [data[1], data[0], data[3], data[2]]
        for end in ends:
            close_port(end)
    finally:
        cables.close()
    assert cables.process.pid is not None
    assert gone(cables.process.pid)
