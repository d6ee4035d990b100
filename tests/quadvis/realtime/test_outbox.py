"""The outbox between an application and the guardian."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block.device import LONGEST
from quadvis.realtime.outbox import BYTES, CHECK, HEAD, LENGTH, ROOM, SLOT, Outbox


def words() -> memoryview:
    return memoryview(np.zeros(Outbox.SIZE, np.int64)).cast("B").cast("q")


def test_the_newest_frame_is_taken_once() -> None:
    shared = words()
    writer, reader = Outbox(shared), Outbox(shared)
    assert reader.take() is None
    writer.put(b"one")
    writer.put(b"two")
    assert reader.take() == b"two"
    assert reader.take() is None


@given(st.lists(st.binary(min_size=1, max_size=LONGEST), min_size=1, max_size=9))
def test_frames_of_any_length_pass_whole(frames: list[bytes]) -> None:
    shared = words()
    writer, reader = Outbox(shared), Outbox(shared)
    for frame in frames:
        writer.put(frame)
        assert reader.take() == frame


@pytest.mark.parametrize("steps", range(4))
def test_a_writer_that_is_killed_in_the_middle_leaves_the_frame_before(steps: int) -> None:
    shared = words()
    writer, reader = Outbox(shared), Outbox(shared)
    writer.put(b"whole")
    at, frame = HEAD + 2 * ROOM, b"partial"
    raw = shared.cast("B")
    for store in [
        lambda: shared.__setitem__(at + LENGTH, len(frame)),
        lambda: shared.__setitem__(at + CHECK, zlib.crc32(frame, 2)),
        lambda: raw.__setitem__(slice(SLOT * (at + BYTES), SLOT * (at + BYTES) + 3), frame[:3]),
    ][:steps]:
        store()
    assert reader.take() == b"whole"
    Outbox(shared).put(b"next")
    assert reader.take() == b"next"


def test_a_number_that_is_seen_before_its_bytes_gives_no_frame_yet() -> None:
    shared = words()
    writer, reader = Outbox(shared), Outbox(shared)
    writer.put(b"before")
    assert reader.take() == b"before"
    shared[0] += 1
    assert reader.take() is None
    at, frame = HEAD + 2 * ROOM, b"after"
    shared[at + LENGTH], shared[at + CHECK] = len(frame), zlib.crc32(frame, 2)
    shared.cast("B")[SLOT * (at + BYTES) : SLOT * (at + BYTES) + len(frame)] = frame
    assert reader.take() == frame


def write_for_ever(shared: Any) -> None:
    box, number = Outbox(memoryview(shared).cast("B").cast("q")), 0
    while True:
        number += 1
        box.put(bytes([number % 256]) * 200)


@pytest.mark.slow
def test_frames_stay_whole_while_writers_are_killed_and_replaced() -> None:
    context = multiprocessing.get_context("spawn")
    shared = context.RawArray("q", Outbox.SIZE)
    reader, taken = Outbox(memoryview(shared).cast("B").cast("q")), 0
    for kill in 3 * (signal.SIGKILL,):
        process = context.Process(target=write_for_ever, args=(shared,))
        process.start()
        seen, until = 0, time.monotonic() + 60
        while seen < 50 and time.monotonic() < until:
            frame = reader.take()
            if frame is not None:
                seen += 1
                assert frame == frame[:1] * 200
        assert process.pid is not None
        os.kill(process.pid, kill)
        process.join()
        taken += seen
    assert taken == 150
