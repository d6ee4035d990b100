"""The ring against a queue: whatever its size, and however puts and takes follow each other."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.realtime.ring import RecordRing


@given(
    st.booleans(),
    st.integers(1, 9),
    st.lists(st.integers(0, 3), min_size=1, max_size=3),
    st.lists(st.one_of(st.integers(1, 12), st.just("take")), max_size=30),
)
def test_what_is_put_is_taken_in_its_order_and_what_finds_no_room_is_counted(
    in_order: bool, room: int, sizes: list[int], actions: list[int | str]
) -> None:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("quadvis.realtime.ring.IN_ORDER", in_order)
        check_ring(in_order, room, sizes, actions)


def check_ring(in_order: bool, room: int, sizes: list[int], actions: list[int | str]) -> None:
    width = 1 + sum(sizes)
    words = memoryview(np.zeros(RecordRing.size(room, width), np.int64))
    producer, consumer = RecordRing(words, room, width), RecordRing(words, room, width)
    memory = np.zeros(100, np.int64)
    raw = memoryview(memory).cast("B")
    starts = [30 * place for place in range(len(sizes))]
    pieces = [slice(8 * start, 8 * (start + size)) for start, size in zip(starts, sizes, strict=True)]
    waiting: deque[list[int]] = deque()
    number = lost = seen = 0

    def check(found: np.ndarray, count: int) -> None:
        assert found.shape == (count, width)
        assert found.tolist() == [waiting.popleft() for _ in range(count)]

    for action in actions:
        if action == "take":
            count, seen = seen, len(waiting)  # those that were there at the last call
            seen -= count
            if in_order:
                count, seen = count + seen, 0
            check(consumer.take(), count)
            continue
        for _ in range(int(action)):
            memory[:] = np.arange(100) + 1000 * number
            producer.put(number, raw, pieces)
            if len(waiting) < room:
                some = [memory[start : start + size] for start, size in zip(starts, sizes, strict=True)]
                waiting.append([number, *np.concatenate(some).tolist()])
            else:
                lost += 1
            number += 1
    check(consumer.take(last=True), len(waiting))
    assert producer.lost == consumer.lost == lost


def test_taken_records_are_the_callers_own() -> None:
    words = memoryview(np.zeros(RecordRing.size(1, 2), np.int64))
    ring, raw = RecordRing(words, 1, 2), memoryview(np.array([7], np.int64)).cast("B")
    ring.put(1, raw, [slice(0, 8)])
    found = ring.take(last=True)
    ring.put(2, memoryview(np.array([8], np.int64)).cast("B"), [slice(0, 8)])
    assert found.tolist() == [[1, 7]]


@pytest.mark.parametrize("room", [1, 5])
def test_the_words_of_a_ring_are_exactly_used(room: int) -> None:
    words = memoryview(np.zeros(RecordRing.size(room, 3), np.int64))
    ring = RecordRing(words, room, 3)
    for number in range(room):
        ring.put(number + 1, memoryview(np.full(2, 9, np.int64)).cast("B"), [slice(0, 16)])
    assert words[-1] == 9
    assert ring.lost == 0
