from __future__ import annotations

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.wire.limits import REQUEST
from quadvis.wire.messages import (
    Reply,
    Request,
    UnreadableError,
    pack_reply,
    pack_request,
    pack_stream,
    read_reply,
    read_request,
    read_stream,
)
from quadvis.wire.refusals import BadError, BusyError

GOOD = {"v": 1, "id": 7, "cmd": "status", "args": {}, "deadline": 2.5}


def test_a_request_and_a_reply_come_back_as_they_were_sent() -> None:
    sent = Request(7, "setparam", {"values": {"a": [1.5, 2]}, "data": b"\xff"}, 2.5)
    found = read_request(pack_request(sent))
    assert (found.id, found.cmd, found.args, found.deadline) == (7, "setparam", dict(sent.args), 2.5)
    assert found.items > 10
    assert read_reply(pack_reply(Reply(7, {"x": np.float64(1.5), "y": np.arange(3)}, 12))) == Reply(
        7, {"x": 1.5, "y": [0, 1, 2]}, 12
    )
    error = read_reply(pack_reply(Reply(8, error=BusyError("later")))).error
    assert isinstance(error, BusyError) and str(error) == "later"


def test_a_request_that_no_target_takes_is_not_sent() -> None:
    data = bytes(REQUEST - 100)
    assert read_request(pack_request(Request(1, "put", {"data": data}))).args["data"] == data
    with pytest.raises(BadError, match=f"the request has 524... bytes, more than {REQUEST}; send less"):
        pack_request(Request(1, "put", {"data": bytes(REQUEST - 20)}))


def test_a_deadline_may_be_left_out() -> None:
    assert read_request(msgpack.packb({key: GOOD[key] for key in ("v", "id", "cmd", "args")})).deadline == 600


WITHOUT_ID = [
    [], None, 5, {}, {**GOOD, "id": None}, {**GOOD, "id": -1}, {**GOOD, "id": 2**53 + 1},
    {**GOOD, "id": True}, {**GOOD, "id": 1.0},
]  # fmt: skip
WITH_ID = [
    {**GOOD, "v": 2}, {**GOOD, "v": True}, {**GOOD, "v": 1.0}, {**GOOD, "more": 1},
    {"v": 1, "id": 7, "cmd": "status"},
    {**GOOD, "cmd": 1}, {**GOOD, "cmd": "x" * 201}, {**GOOD, "args": []}, {**GOOD, "args": None},
    {**GOOD, "deadline": 0}, {**GOOD, "deadline": -1.0}, {**GOOD, "deadline": float("nan")},
    {**GOOD, "deadline": float("inf")}, {**GOOD, "deadline": 601}, {**GOOD, "deadline": "1"},
    {**GOOD, "deadline": True},
]  # fmt: skip


@pytest.mark.parametrize("envelope", WITHOUT_ID + WITH_ID, ids=str)
def test_an_envelope_with_a_fault_is_refused_with_its_number_if_it_has_one(envelope: object) -> None:
    with pytest.raises(UnreadableError) as caught:
        read_request(msgpack.packb(envelope))
    assert caught.value.id == (7 if envelope in WITH_ID else None)


def test_a_text_that_is_not_utf8_is_refused() -> None:
    with pytest.raises(UnreadableError, match="UTF-8"):
        read_request(msgpack.packb(GOOD).replace(b"status", b"stat\xff\xfe"))


@pytest.mark.faults
@given(st.binary(max_size=200))
def test_random_bytes_are_no_request_and_no_reply(data: bytes) -> None:
    for read in (read_request, read_reply):
        with pytest.raises(BadError):
            read(data)


@pytest.mark.parametrize(
    "data",
    [b"\x91" * 60_000, b"\x81\xa1a" * 20_000, b"\xc7\x02\x05ab", msgpack.packb({1: 2}),
     msgpack.packb({"id": 1, "ok": True, "result": msgpack.ExtType(5, b"x")})],
)  # fmt: skip
def test_an_odd_answer_of_a_target_is_refused(data: bytes) -> None:
    with pytest.raises(BadError):
        read_reply(data)


@pytest.mark.faults
@given(st.data())
def test_a_changed_request_is_read_or_refused(draw: st.DataObject) -> None:
    data = bytearray(msgpack.packb(GOOD | {"args": {"names": ["a", "b"], "x": 1.5}}))
    for _ in range(draw.draw(st.integers(1, 3))):
        data[draw.draw(st.integers(0, len(data) - 1))] = draw.draw(st.integers(0, 255))
    try:
        found = read_request(bytes(data))
    except UnreadableError:
        return
    assert isinstance(found.cmd, str) and isinstance(found.args, dict) and 0 <= found.id <= 2**53


@pytest.mark.parametrize(
    "array",
    [np.arange(6.0).reshape(2, 3), np.arange(4, dtype=">i2"), np.zeros((0, 3), "f4"), np.array([True, False]),
     np.arange(12.0).reshape(3, 4)[:, ::2]],
    ids=str,
)  # fmt: skip
def test_an_array_comes_back_as_it_was_sent(array: np.ndarray) -> None:
    found = read_stream(pack_stream("scope/1", 5, {"time": 2.5}, array))
    assert (found.topic, found.number, found.header) == ("scope/1", 5, {"time": 2.5})
    assert found.array.shape == array.shape and (found.array == array).all()
    assert found.array.dtype.kind == array.dtype.kind and found.array.dtype.byteorder in "=|<"


@pytest.mark.parametrize(
    "facts",
    [{"type": "|O", "shape": [1]}, {"type": "<f8", "shape": [2]}, {"type": "<f8", "shape": [-1]},
     {"type": "<f8"},
     {"type": "<f8", "shape": [2**40, 2**40]}, {"type": "f8,f8", "shape": [1]}, {"type": 1, "shape": [1]},
     {"type": "<U8", "shape": [1]}, {"type": "<f8", "shape": [True]}],
    ids=str,
)  # fmt: skip
def test_an_array_with_a_wrong_description_is_refused(facts: dict[str, object]) -> None:
    with pytest.raises(BadError):
        read_stream([b"state", msgpack.packb({"v": 1, "number": 1} | facts), bytes(8)])


def test_what_cannot_be_sent_is_refused() -> None:
    for value in (object(), 2**70, b"x" * (5 << 20)):
        with pytest.raises(BadError):
            pack_reply(Reply(1, value))
    for array in (np.array(["a"]), np.zeros(1 << 20), np.array([object()])):
        with pytest.raises(BadError):
            pack_stream("state", 1, {}, array)
