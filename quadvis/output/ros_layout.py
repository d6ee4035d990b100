"""Where the numbers of a ROS 2 message lie in its CDR bytes.

The places depend on the lengths of the texts and sequences before them. So one message is walked through,
and all others with equal lengths at the same places have the same layout: their numbers are columns.

Source: https://www.omg.org/spec/DDSI-RTPS, 10.2 (CDR in both orders of bytes)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from quadvis.output.ros_schema import NUMBERS, TEXT, Fields, MessageField
from quadvis.output.ros_standard import UNITS

HEAD = 4  # bytes that say the encoding
ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}
LONGEST = 4096  # elements of a sequence that is a signal; longer ones are pictures and clouds
BYTES = ("byte", "char", "uint8", "int8")


class MessageError(ValueError):
    """A message contradicts its definition."""


class MessageNumbers(NamedTuple):
    """MessageNumbers of one message: name, type of numpy, place, shape and unit."""

    name: str
    type: str
    start: int
    shape: tuple[int, ...]
    unit: str


class MessageLayout(NamedTuple):
    """The numbers of a message, and the bytes of the lengths that all messages of this layout share."""

    numbers: tuple[MessageNumbers, ...]
    lengths: tuple[tuple[int, bytes], ...]

    def fits(self, data: bytes) -> bool:
        """Return whether another message of the same size has the same layout."""
        return all(data[place : place + len(each)] == each for place, each in self.lengths)


def layout(types: Mapping[str, Fields], root: str, data: bytes) -> MessageLayout:
    """Walk through a message; MessageError if it is too short for its type, or of another encoding."""
    walk = _Walk(types, data)
    walk.message(root, "", "", named=True)
    return MessageLayout(tuple(walk.numbers), ((0, data[:2]), *walk.lengths))


class _Walk:
    """The way through one message."""

    def __init__(self, types: Mapping[str, Fields], data: bytes) -> None:
        if data[:2] not in ORDERS:
            raise MessageError
        self.types, self.data, self.order, self.place = types, data, ORDERS[data[:2]], HEAD
        self.numbers: list[MessageNumbers] = []
        self.lengths: list[tuple[int, bytes]] = []

    def message(self, name: str, prefix: str, unit: str, named: bool) -> None:
        """Walk through the fields of a message; `named` ones become signals."""
        fields = self.types[name]
        if not fields:
            self._skip(1, 1)  # a message without fields has one byte
        first = len(self.numbers)
        for field in fields:
            full = f"{prefix}.{field.name}" if prefix else field.name
            self._field(field, full, UNITS.get((name, field.name), unit), named)
        if named and len(fields) > 1:
            self._join(fields, first, prefix, unit)

    def _join(self, fields: Fields, first: int, name: str, unit: str) -> None:
        """Let a message of nothing but numbers of one kind be a vector, too."""
        kinds = {(field.type, field.size) for field in fields}
        if len(kinds) == 1 and (kind := kinds.pop())[0] in NUMBERS and kind[1] is None:
            made = self.numbers[first]
            self.numbers.insert(
                first, MessageNumbers(name, made.type, made.start, (len(fields),), unit or "1")
            )

    def _field(self, field: MessageField, name: str, unit: str, named: bool) -> None:
        count = 1 if field.size is None else field.size or self._length()
        if field.type in NUMBERS:
            self._numbers(field, name, unit, count, named)
        elif field.type == TEXT:
            for _ in range(count):
                self._skip(1, self._length())
        else:
            for _ in range(count):
                self.message(field.type, name, unit, named and field.size is None)

    def _numbers(self, field: MessageField, name: str, unit: str, count: int, named: bool) -> None:
        kind = NUMBERS[field.type]
        start = self._skip(int(kind[1]), count) if count else self.place
        shape = () if field.size is None else (count,)
        picture = count > LONGEST or (field.size == 0 and field.type in BYTES)
        if named and not picture:
            self.numbers.append(MessageNumbers(name, self.order + kind, start, shape, unit or "1"))

    def _skip(self, size: int, count: int) -> int:
        """Step over values; return the place of the first one."""
        start = self.place + -(self.place - HEAD) % size
        self.place = start + size * count
        if self.place > len(self.data):
            raise MessageError
        return start

    def _length(self) -> int:
        """Return the length of a text or sequence, which stands before it."""
        start = self._skip(4, 1)
        found = self.data[start : start + 4]
        self.lengths.append((start, found))
        length = int.from_bytes(found, "little" if self.order == "<" else "big")
        if length > len(self.data):
            raise MessageError
        return length
