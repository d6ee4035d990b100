"""The look at a message before it is unpacked: what msgpack itself accepts, and no bomb."""

from __future__ import annotations

import struct

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.wire.limits import DEPTH, ITEMS, REQUEST, TEXT
from quadvis.wire.refusals import BadError
from quadvis.wire.scan import scan

LEAVES = st.none() | st.booleans() | st.floats() | st.text(max_size=40) | st.binary(max_size=300)
LEAVES |= st.integers(-(2**63), 2**64 - 1)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=20) | st.dictionaries(st.text(max_size=5), inner, max_size=20),
)


def depth(value: object) -> int:
    if isinstance(value, dict):
        value = list(value.values())
    return 1 + max(map(depth, value), default=0) if isinstance(value, list) else 0


def count(value: object) -> int:
    if isinstance(value, dict):
        return 1 + sum(1 + count(each) for each in value.values())
    return 1 + sum(map(count, value)) if isinstance(value, list) else 1


@given(VALUES)
def test_what_msgpack_writes_is_accepted_and_its_values_are_counted(value: object) -> None:
    data = msgpack.packb(value)
    if depth(value) > DEPTH:
        with pytest.raises(BadError):
            scan(data)
    else:
        assert scan(data) == count(value)


def accepted(data: bytes) -> bool:
    """Whether msgpack's own unpacker accepts a message, without extension types and keys that are no text."""
    odd = []
    try:
        msgpack.unpackb(
            data, raw=True, strict_map_key=False, ext_hook=lambda *_: odd.append(1), timestamp=0,
            object_pairs_hook=lambda pairs: odd.extend(1 for key, _ in pairs if not isinstance(key, bytes)),
        )  # fmt: skip
    except (ValueError, TypeError):
        return False
    return not odd


def scanned(data: bytes) -> bool:
    try:
        scan(data)
    except BadError:
        return False
    return True


@pytest.mark.faults
@given(st.binary(max_size=60))
def test_random_bytes_are_accepted_only_if_msgpack_accepts_them(data: bytes) -> None:
    assert not scanned(data) or accepted(data)


@pytest.mark.faults
@given(VALUES, st.data())
def test_a_changed_message_is_accepted_only_if_msgpack_accepts_it(value: object, draw: st.DataObject) -> None:
    data = bytearray(msgpack.packb(value))
    for _ in range(draw.draw(st.integers(1, 4))):
        data[draw.draw(st.integers(0, len(data) - 1))] = draw.draw(st.integers(0, 255))
    changed = bytes(data[: draw.draw(st.integers(0, len(data)))])
    assert not scanned(changed) or accepted(changed)


def nested(levels: int) -> bytes:
    return b"\x91" * levels + b"\xc0"


BOMBS = {
    "half a million empty maps": b"\xdd" + struct.pack(">I", 500_000) + b"\x80" * 500_000,
    "maps by the number of lists": (b"\xdc\xff\xff" + b"\xdc\x00\x40" * 65535)[: 1 << 18],
    "whole lists of whole lists": b"\xdc\x01\x2c" + (b"\xdc\x01\x2c" + b"\xc0" * 300) * 300,
    "a list longer than any memory": b"\xdd\xff\xff\xff\xff",
    "a map longer than any memory": b"\xdf\xff\xff\xff\xff",
    "a text longer than the message": b"\xdb\xff\xff\xff\xff",
    "bytes longer than the message": b"\xc6\xff\xff\xff\xff",
    "a length that is cut": b"\xc6\xff",
    "deep": nested(DEPTH + 1),
    "very deep": nested(500_000),
    "a long text": b"\xdb" + struct.pack(">I", TEXT + 1) + b"a" * (TEXT + 1),
    "too long": b"\xc6" + struct.pack(">I", REQUEST) + b"a" * REQUEST,
    "an extension": b"\xc7\x02\x05ab",
    "a time": b"\xd6\xff\x00\x00\x00\x00",
    "a short extension": b"\xd4\x01\x00",
    "the byte without meaning": b"\xc1",
    "a number as a key": b"\x81\x01\x02",
    "a list as a key": b"\x81\x90\x02",
    "two values": b"\x01\x02",
    "nothing": b"",
}


@pytest.mark.faults
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused(name: str) -> None:
    with pytest.raises(BadError):
        scan(BOMBS[name])


def test_the_limits_themselves_are_accepted() -> None:
    assert scan(nested(DEPTH)) == DEPTH + 1
    assert scan(msgpack.packb([None] * (ITEMS - 1))) == ITEMS
    assert scan(msgpack.packb("a" * TEXT)) == 1
    assert scan(msgpack.packb(b"a" * (REQUEST - 5))) == 1
