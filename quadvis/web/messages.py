"""Messages between gateway and page. Text is JSON; bytes carry what JSON cannot, samples and files.

 page to gateway    {"token"} first; then {"id", "verb", "args"} or {"beat"}
 gateway to page    {"hello"}, {"reply", "ok", "result" | "error"}, {"topic", "data"}, {"beat", "heard", ...}
                    the topic "watched" says which signals the numbers of "values" are of
 bytes              length of the head (uint32, little-endian), the head as JSON, spaces up to a multiple
                    of 8, then the numbers (float64, little-endian, row by row) or the bytes of a file

JSON has no NaN and no infinity: they are the texts that JavaScript's Number reads.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from typing import Any, NamedTuple

from quadvis.errors import QuadvisError
from quadvis.wire.finite import finite

MOST_TEXT = 64_000  # bytes of a message from a page
MOST_HEADS = 64  # topics whose headers are kept
MOST_NAMES = 1000  # signals that one page watches


_ENCODER = json.JSONEncoder(separators=(",", ":"), allow_nan=False)


class PageRequest(NamedTuple):
    """What a page asks for: its number, the verb and its arguments."""

    id: int
    verb: str
    arguments: dict[str, Any]


def text(value: Mapping[str, Any]) -> str:
    """Return plain data as JSON."""
    try:
        return _ENCODER.encode(value)
    except ValueError:
        return json.dumps(finite(value, _number), separators=(",", ":"))
    except TypeError:
        return json.dumps(finite(value, _number), separators=(",", ":"), default=str)


def _number(value: float) -> str:
    """Return a number that is not finite as JavaScript's Number reads it."""
    return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"


def packed(head: Mapping[str, Any], data: bytes) -> bytes:
    """Return a message of bytes."""
    return _joined(text(head), data)


def _joined(head: str, data: bytes) -> bytes:
    front = head.encode()
    front += b" " * (-(len(front) + 4) % 8)
    return struct.pack("<I", len(front)) + front + data


class Heads:
    """Packs stream data with arrays. What many headers of a topic have in common is made JSON of once."""

    CHANGING = ("sequence", "trigger", "lost")  # what is another one in each message

    def __init__(self) -> None:
        self._known: dict[str, tuple[Mapping[str, Any], tuple[int, ...], str]] = {}

    def packed(self, topic: str, header: Mapping[str, Any], array: Any) -> bytes:
        """Return a header and an array as a message."""
        import numpy as np

        rows = np.ascontiguousarray(array, "<f8")
        return _joined(self._head(topic, header, rows.shape), rows.tobytes())

    def _head(self, topic: str, header: Mapping[str, Any], shape: tuple[int, ...]) -> str:
        lasting = {key: value for key, value in header.items() if key not in self.CHANGING}
        known = self._known.get(topic)
        if known is None or known[0] != lasting or known[1] != shape:
            if len(self._known) >= MOST_HEADS:
                self._known.clear()
            head = text({"topic": topic, "shape": shape, "data": lasting})
            known = self._known[topic] = lasting, shape, head
        changing = {key: header[key] for key in self.CHANGING if key in header}
        if not changing:
            return known[2]
        return known[2][:-2] + "," * bool(lasting) + text(changing)[1:] + "}"


def reply(number: int, result: Any) -> str | bytes:
    """Return the answer to a request; bytes in its result, at most one entry, travel as they are."""
    if isinstance(result, Mapping):
        for key, value in result.items():
            if isinstance(value, bytes | bytearray | memoryview):
                rest = {name: each for name, each in result.items() if name != key}
                return packed({"reply": number, "ok": True, "result": rest, "bytes": key}, bytes(value))
    return text({"reply": number, "ok": True, "result": result})


def refusal(number: int, sentence: str) -> str:
    """Return the answer to a request that is refused."""
    return text({"reply": number, "ok": False, "error": sentence})


def read(message: str | bytes) -> Mapping[str, Any]:
    """Return the object in a message from a page; QuadvisError if there is none."""
    if isinstance(message, bytes):
        raise QuadvisError("a page sends no bytes")
    try:
        found = json.loads(message)
    except (ValueError, RecursionError):
        raise QuadvisError("this is no JSON") from None
    if not isinstance(found, dict):
        raise QuadvisError("a message is an object")
    return found


def read_request(found: Mapping[str, Any]) -> PageRequest:
    """Return the request in a message; QuadvisError if it is none."""
    number, verb, arguments = found.get("id"), found.get("verb"), found.get("args", {})
    whole = isinstance(number, int) and not isinstance(number, bool) and 0 <= number < 2**53
    if not whole or not isinstance(verb, str) or not isinstance(arguments, dict):
        raise QuadvisError("a request has 'id', 'verb' and 'args'")
    return PageRequest(number, verb, arguments)  # type: ignore[arg-type]


def read_names(arguments: Mapping[str, Any], key: str) -> list[str]:
    """Return a list of names among the arguments; QuadvisError if it is none, or too long."""
    names = arguments.get(key)
    if not isinstance(names, list) or not all(isinstance(name, str) and len(name) <= 200 for name in names):
        raise QuadvisError(f"'{key}' is a list of names")
    if len(names) > MOST_NAMES:
        raise QuadvisError(f"'{key}' has {len(names)} names; at most {MOST_NAMES} are possible")
    return names
