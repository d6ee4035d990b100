"""Messages as bytes: a request, its reply, stream data. The page of the wire (`page`) has their layout."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgpack

from quadvis.errors import quoted
from quadvis.wire.argument import is_number, is_whole
from quadvis.wire.limits import ITEMS, LONGEST_DEADLINE, MESSAGE, NAME, REQUEST, VERSION
from quadvis.wire.refusals import BadError, WireError, wire_error
from quadvis.wire.scan import scan

_REQUIRED = frozenset(("v", "id", "cmd", "args"))
_MOST_ID = 2**53  # whole numbers up to here are exact in every language


@dataclass(frozen=True)
class Request:
    """One request: its number, the verb, its arguments, and how long an answer is waited for (s)."""

    id: int
    cmd: str
    args: Mapping[str, Any]
    deadline: float = LONGEST_DEADLINE
    items: int = 1


@dataclass(frozen=True)
class Reply:
    """The answer to a request: a result, with the tick at which it took effect if it has one, or an error."""

    id: int
    result: Any = None
    tick: int | None = None
    error: WireError | None = None


class StreamData(NamedTuple):
    """Data of a topic: its number among all of this topic, what is said about it, and an array or None."""

    topic: str
    number: int
    header: Mapping[str, Any]
    array: Any = None


class UnreadableError(BadError):
    """A message without a whole envelope; ``id`` is its number, None if not even that can be read."""

    def __init__(self, words: str, number: int | None = None) -> None:
        """Keep the number of the request."""
        self.id = number
        super().__init__(words)


def pack(value: Any) -> bytes:
    """Return plain data as msgpack; arrays and numbers of numpy become lists and numbers.

    BadError if the data is too long for one message, or cannot be sent.
    """
    try:
        data: bytes = msgpack.packb(value, default=_plain)
    except (TypeError, ValueError, OverflowError) as error:
        raise BadError(f"this cannot be sent: {error}") from None
    if len(data) > MESSAGE:
        raise BadError(f"the answer has {len(data)} bytes, more than {MESSAGE}; ask for less at once")
    return data


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a value of type {type(value).__name__}")


def unpack(data: bytes, **limits: int) -> tuple[Any, int]:
    """Return the value of a message, and how many values are in it; BadError beyond the limits."""
    count = scan(data, **limits)
    return _unpacked(data), count


def _unpacked(data: bytes) -> Any:
    try:
        return msgpack.unpackb(data, raw=False, strict_map_key=True, ext_hook=_no_extension)
    except (ValueError, RecursionError) as error:  # a UnicodeDecodeError is one
        raise BadError("the message has a text that is not UTF-8, or is no whole value") from error


def _no_extension(kind: int, data: bytes) -> Any:
    raise ValueError(f"an extension of type {kind}")


def _unpack_answer(data: bytes) -> Any:
    """Return the value of a message of a target.

    A short one cannot have many values, and is not looked through: hosts get many of these.
    """
    if len(data) <= ITEMS:
        return _unpacked(data)
    return unpack(data, most=MESSAGE, text=MESSAGE, items=1 << 20)[0]


def pack_request(request: Request) -> bytes:
    """Return the bytes of a request; BadError if it is too long."""
    data = pack(
        {"v": VERSION, "id": request.id, "cmd": request.cmd, "args": dict(request.args),
         "deadline": request.deadline}
    )  # fmt: skip
    if len(data) > REQUEST:
        raise BadError(f"the request has {len(data)} bytes, more than {REQUEST}; send less at once")
    return data


def read_request(data: bytes) -> Request:
    """Return the request in a message; UnreadableError if there is none."""
    try:
        found, items = unpack(data)
    except BadError as error:
        raise UnreadableError(str(error)) from None
    if not isinstance(found, dict):
        raise UnreadableError("a request is a map")
    number = found.get("id")
    if not isinstance(number, int) or not is_whole(number, 0, _MOST_ID):
        raise UnreadableError(f"a request has a number 'id' from 0 to {_MOST_ID}")

    def wrong(words: str) -> UnreadableError:
        return UnreadableError(words, number)

    if found.get("v") != VERSION or isinstance(found["v"], bool | float):
        raise wrong(
            f"the version 'v' of the request is {quoted(found.get('v'))}; this target talks {VERSION}"
        )
    keys = found.keys() - {"deadline"}
    if keys != _REQUIRED:
        raise wrong(f"a request has 'v', 'id', 'cmd', 'args' and 'deadline', not {quoted(', '.join(keys))}")
    if not isinstance(found["cmd"], str) or len(found["cmd"]) > NAME:
        raise wrong("the verb 'cmd' of a request is a text")
    if not isinstance(found["args"], dict):
        raise wrong("the arguments 'args' of a request are a map")
    deadline = found.get("deadline", LONGEST_DEADLINE)
    if not is_number(deadline) or not 0 < deadline <= LONGEST_DEADLINE:
        raise wrong(f"the deadline of a request is more than 0 and at most {LONGEST_DEADLINE:g} s")
    return Request(number, found["cmd"], found["args"], float(deadline), items)


def pack_reply(reply: Reply) -> bytes:
    """Return the bytes of a reply."""
    facts: dict[str, Any] = {"v": VERSION, "id": reply.id, "ok": reply.error is None}
    if reply.error is not None:
        facts["error"] = {"kind": reply.error.kind, "sentence": str(reply.error)}
    else:
        facts["result"] = reply.result
    if reply.tick is not None:
        facts["tick"] = int(reply.tick)
    return pack(facts)


def read_reply(data: bytes) -> Reply:
    """Return the reply in a message; BadError if there is none."""
    found = _unpack_answer(data)
    if not isinstance(found, dict) or not is_whole(found.get("id"), 0, _MOST_ID):
        raise BadError("the answer is no reply")
    tick = found.get("tick") if is_whole(found.get("tick"), 0, 2**63) else None
    if found.get("ok") is True:
        return Reply(found["id"], found.get("result"), tick)
    facts = found.get("error")
    facts = facts if isinstance(facts, dict) else {}
    return Reply(found["id"], error=wire_error(str(facts.get("kind")), str(facts.get("sentence", ""))))


def pack_stream(topic: str, number: int, header: Mapping[str, Any], array: Any = None) -> list[bytes]:
    """Return the three frames of stream data; an array is sent as little-endian numbers, row by row."""
    facts = {"v": VERSION, "number": number, **header}
    if array is None:
        return [topic.encode(), pack(facts), b""]
    import numpy as np

    array = np.ascontiguousarray(array)
    array = array.astype(array.dtype.newbyteorder("<"), copy=False)
    if array.dtype.kind not in "biuf":
        raise BadError(f"an array of type {array.dtype} cannot be sent")
    if array.nbytes > MESSAGE:
        raise BadError(f"an array of {array.nbytes} bytes cannot be sent, more than {MESSAGE}")
    facts |= {"type": array.dtype.str, "shape": list(array.shape)}
    return [topic.encode(), pack(facts), array.tobytes()]


def read_stream(frames: Sequence[bytes]) -> StreamData:
    """Return the stream data of three frames; BadError if they are none."""
    if len(frames) != 3:
        raise BadError(f"stream data has 3 frames, not {len(frames)}")
    facts = _unpack_answer(frames[1])
    if not isinstance(facts, dict) or not is_whole(facts.get("number"), 0, 2**63):
        raise BadError("stream data has no number")
    topic = frames[0].decode("utf-8", "replace")
    header = {key: value for key, value in facts.items() if key not in ("v", "number", "type", "shape")}
    return StreamData(topic, facts["number"], header, _array(facts, frames[2]))


def _array(facts: Mapping[str, Any], data: bytes) -> Any:
    kind, shape = facts.get("type"), facts.get("shape")
    if kind is None and shape is None:
        return None
    import numpy as np

    if not isinstance(kind, str) or kind[1:] not in (
        "b1",
        "i1",
        "i2",
        "i4",
        "i8",
        "u1",
        "u2",
        "u4",
        "u8",
        "f4",
        "f8",
    ):
        raise BadError("stream data has an array of a type that is not used here")
    if not isinstance(shape, list) or not all(is_whole(size, 0, MESSAGE) for size in shape):
        raise BadError("stream data has an array without a shape")
    kind = np.dtype(kind)
    if kind.itemsize * math.prod(shape) != len(data):
        raise BadError("stream data has an array with more or fewer bytes than its shape")
    return np.frombuffer(data, kind).reshape(shape)
