"""Definitions of ROS 2 messages (`ros2msg`): the fields of a type and of all types in it.

Source: https://mcap.dev/spec/registry#ros2msg, https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from quadvis.errors import QuadvisError, quoted
from quadvis.output.ros_standard import DEFINITIONS

NUMBERS = {
    "bool": "b1", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
TEXT = "string"
DEEPEST = 16  # messages inside of messages
_NEXT = re.compile(r"^=+[ \t]*\r?\nMSG:[ \t]*(\S+)[ \t]*\r?$", re.MULTILINE)
_FIELD = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<many>\[(?P<bound><=)?(?P<count>\d*)\])?\s+(?P<name>[A-Za-z]\w*)"
    r"(?P<constant>\s*=(?!=))?",
    re.ASCII,
)


class MessageField(NamedTuple):
    """One field of a message: `type` is a primitive or a full name, such as geometry_msgs/Point.

    `size` is None for one value, 0 for a sequence whose length stands before it, else that of an array.
    """

    name: str
    type: str
    size: int | None = None


Fields = tuple[MessageField, ...]


def short_name(text: str) -> str:
    """Return a type's name without its middle: geometry_msgs/msg/Point is geometry_msgs/Point."""
    return text.replace("/msg/", "/", 1)


def read_schema(name: str, text: str) -> dict[str, Fields]:
    """Return the fields of the message and of all that it holds, by type; QuadvisError says what is wrong.

    Without a text the standard definition is taken.
    """
    root = short_name(name)
    parts = _NEXT.split(text)
    texts = {root: parts[0] if text.strip() else DEFINITIONS.get(root, "")}
    if not text.strip() and root not in DEFINITIONS:
        raise QuadvisError(f"the file has no definition of {quoted(root)}, which is no standard message")
    texts.update(zip(map(short_name, parts[1::2]), parts[2::2], strict=True))
    found: dict[str, Fields] = {}
    _resolve(root, texts, found, (), {})
    return found


def _resolve(
    name: str,
    texts: Mapping[str, str],
    found: dict[str, Fields],
    around: tuple[str, ...],
    depths: dict[str, int],
) -> None:
    """Read a type inside of others, and the types of its fields."""
    if name in around:
        raise QuadvisError(f"{quoted(name)} holds itself")
    if name not in found:
        text = texts.get(name, DEFINITIONS.get(name))
        if text is None:
            raise QuadvisError(f"the file has no definition of {quoted(name)}")
        found[name] = _fields(name, text)
        inner = [field.type for field in found[name] if field.type not in NUMBERS and field.type != TEXT]
        for each in inner:
            _resolve(each, texts, found, (*around, name), depths)
        depths[name] = 1 + max((depths[each] for each in inner), default=0)
    if len(around) + depths.get(name, 0) > DEEPEST:
        raise QuadvisError(f"messages are nested deeper than {DEEPEST}")


def _fields(name: str, text: str) -> Fields:
    """Return the fields of one type, without its constants."""
    fields = []
    for line in re.split(r"[;\n]", text) if name in DEFINITIONS and "\n" not in text else text.split("\n"):
        plain = line.partition("#")[0].strip()
        if not plain:
            continue
        match = _FIELD.match(plain)
        if match is None:
            raise QuadvisError(f"{quoted(name)} has the line {quoted(plain)}, which is no field")
        if match["constant"]:
            continue
        count = None if match["many"] is None else 0 if match["bound"] else int(match["count"] or 0)
        fields.append(MessageField(match["name"], _full(match["type"], name), count))
    return tuple(fields)


def _full(name: str, inside: str) -> str:
    """Return the full name of a type as it is written inside another one."""
    if name in NUMBERS or name == TEXT:
        return name
    if name == "wstring":
        raise QuadvisError("it has texts of the kind wstring, which are not read")
    if name == "Header":
        return "std_msgs/Header"
    return short_name(name) if "/" in name else f"{inside.rpartition('/')[0]}/{name}"
