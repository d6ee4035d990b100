"""Frames as another implementation reads them, and heads that are packed piece by piece."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from websockets.client import ClientProtocol
from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.uri import parse_uri

from quadvis.web.line import framed
from quadvis.web.messages import Heads

MESSAGES = st.one_of(st.text(max_size=300), st.binary(max_size=300))


@given(st.lists(MESSAGES, max_size=5))
def test_a_client_reads_all_messages_from_one_write(messages: list[str | bytes]) -> None:
    client = ClientProtocol(parse_uri("ws://127.0.0.1/"), state=State.OPEN)
    client.receive_data(b"".join(map(framed, messages)))
    events = client.events_received()
    assert all(isinstance(event, Frame) and event.fin for event in events)
    found = [event.data.decode() if event.opcode is Opcode.TEXT else bytes(event.data) for event in events]  # type: ignore[union-attr]
    assert found == messages


def test_lengths_of_all_sizes_are_read() -> None:
    for size in (0, 125, 126, 65535, 65536, 70_000):
        client = ClientProtocol(parse_uri("ws://127.0.0.1/"), state=State.OPEN, max_size=None)
        client.receive_data(framed(b"x" * size))
        (event,) = client.events_received()
        assert isinstance(event, Frame) and bytes(event.data) == b"x" * size


PLAIN = st.one_of(st.integers(-9, 9), st.text(max_size=3), st.none(), st.lists(st.integers(), max_size=2))
KEYS = st.sampled_from(["sequence", "trigger", "lost", "names", "set", "without"])


@given(
    st.lists(st.tuples(st.sampled_from("ab"), st.dictionaries(KEYS, PLAIN)), max_size=6), st.integers(1, 3)
)
def test_a_head_is_the_json_of_its_header_whatever_came_before(
    headers: list[tuple[str, dict[str, Any]]], width: int
) -> None:
    heads = Heads()
    for topic, header in headers:
        rows = np.arange(2.0 * width).reshape(2, width)
        message = heads.packed(topic, header, rows)
        (length,) = struct.unpack_from("<I", message)
        found = json.loads(message[4 : 4 + length])
        assert found == {"topic": topic, "shape": [2, width], "data": header}
        assert (4 + length) % 8 == 0 and message[4 + length :] == rows.tobytes()
