"""The messages of a MAVLink dialect: their numbers, checks and fields, as pymavlink defines them.

pymavlink (LGPL) is an extra, and imported here alone, inside functions. Its definitions are used and not its
parser, which skips as many bytes as a damaged header claims, and whose version and check of damage depend on
environment variables. See https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from pkgutil import iter_modules
from typing import Any, NamedTuple

from quadvis.block import ParameterError
from quadvis.errors import quoted, sentence, suggestion

FOLDER = "pymavlink.dialects.v20"
OPAQUE = 40  # numbers in a row from which on a message may carry packets of others


class MessageDefinition(NamedTuple):
    """What a dialect says of a message: its number, its name, and what its payload is.

    ``extra`` is the byte that the checksum takes in: it follows from the names and types of the fields.
    ``fields`` are in the order of the wire, each with its count of values, 0 if it is no array.
    """

    number: int
    name: str
    extra: int
    layout: struct.Struct
    fields: tuple[tuple[str, int], ...]

    def unpack(self, payload: bytes) -> dict[str, Any]:
        """Return the fields of a payload; it may lack its last zeros, or be longer than this definition."""
        values = iter(self.layout.unpack(payload[: self.layout.size].ljust(self.layout.size, b"\0")))
        return {
            name: tuple(next(values) for _ in range(count)) if count else next(values)
            for name, count in self.fields
        }

    def pack(self, **given: Any) -> bytes:
        """Return the payload of fields, the others 0, without its last zeros; TypeError for another name."""
        values: list[Any] = []
        for name, value in self.unpack(b"").items():
            value = given.pop(name, value)
            values += value if isinstance(value, tuple) else [value]
        if given:
            raise TypeError(f"{self.name} has no field {', '.join(given)}")
        return self.layout.pack(*values).rstrip(b"\0") or b"\0"  # one byte at least

    @property
    def is_opaque(self) -> bool:
        """True if the message may carry packets of others."""
        return any(count >= OPAQUE for _, count in self.fields)


class Dialect(NamedTuple):
    """The definitions of a dialect, by number and by name."""

    numbers: Mapping[int, MessageDefinition]
    names: Mapping[str, MessageDefinition]


@lru_cache(maxsize=4)
def dialect(name: str) -> Dialect:
    """Return a dialect; ParameterError if there is none of this name, or no pymavlink."""
    if find_spec("pymavlink") is None:
        problem = "blocks of the group mavlink need the package pymavlink"
        raise ParameterError("dialect", sentence(problem, "install quadvis[mav]"))
    known = [module.name for module in iter_modules(import_module(FOLDER).__path__)]
    if name not in known:
        problem = f"dialect {quoted(name)} is not one of pymavlink's"
        raise ParameterError("dialect", sentence(problem, suggestion(name, known)))
    found = [_definition(each) for each in import_module(f"{FOLDER}.{name}").mavlink_map.values()]
    return Dialect({each.number: each for each in found}, {each.name: each for each in found})


def _definition(message: Any) -> MessageDefinition:
    fields = zip(message.ordered_fieldnames, message.lengths, strict=True)
    counted = tuple((name, length if length > 1 else 0) for name, length in fields)
    return MessageDefinition(message.id, message.msgname, message.crc_extra, message.unpacker, counted)
