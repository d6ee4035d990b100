"""Messages between two processes: whole, in order, bounded; what is none ends the talk."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.wire.pipe import Pipe

LONGEST = 1 << 18
MESSAGES = st.lists(
    st.lists(st.integers(-(2**63), 2**64 - 1) | st.text() | st.binary() | st.none(), min_size=1), max_size=20
)


@contextmanager
def ends() -> Iterator[tuple[Pipe, socket.socket]]:
    near, far = socket.socketpair()
    with near, far:
        far.setblocking(False)
        yield Pipe(near, LONGEST), far


def taken(pipe: Pipe) -> list[Any]:
    return list(iter(pipe.take, None))


@given(MESSAGES, st.lists(st.integers(1, 30)))
def test_messages_are_whole_however_their_bytes_are_cut(messages: list[Any], cuts: list[int]) -> None:
    data = b"".join(map(msgpack.packb, messages))
    found = []
    with ends() as (pipe, far):
        for cut in (*cuts, len(data)):
            far.send(data[:cut])
            data = data[cut:]
            found += taken(pipe)
    assert found == messages


@given(st.binary(min_size=1, max_size=300))
def test_what_is_no_message_ends_the_talk_or_is_waited_for(data: bytes) -> None:
    with ends() as (pipe, far):
        far.send(data)
        try:
            assert all(isinstance(each, list) and each for each in taken(pipe))
        except EOFError:
            return


def test_a_message_that_is_too_long_ends_the_talk() -> None:
    with ends() as (pipe, far):
        left = memoryview(msgpack.packb([bytes(2 * LONGEST)]))
        with pytest.raises(EOFError):
            while left:
                left = left[far.send(left[:4096]) :]
                assert pipe.take() is None


def test_what_is_sent_waits_for_a_reader_and_comes_whole() -> None:
    messages = [[number, bytes(1000 * number)] for number in range(100)]
    near, far = socket.socketpair()
    with near, far:
        sender, reader = Pipe(near, LONGEST), Pipe(far, LONGEST)
        for message in messages:
            sender.put(*message)
        sender.flush()
        assert sender.waiting > 1_000_000  # more than the system takes
        found = []
        while sender.waiting:
            found += taken(reader)
            sender.flush()
        assert found + taken(reader) == messages


def test_what_was_sent_before_an_end_is_read_and_then_the_end() -> None:
    with ends() as (pipe, far):
        far.send(msgpack.packb(["last"]))
        pipe.put("nobody reads this")
        far.close()
        pipe.flush()
        assert pipe.waiting == 0 and pipe.take() == ["last"]
        with pytest.raises(EOFError):
            pipe.take()
