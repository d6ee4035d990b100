"""Types and values of LLVM's text in C. Whole numbers are unsigned in C, where they may wrap around."""

from __future__ import annotations

import re
import struct

from quadvis.errors import QuadvisError
from quadvis.export.assembly_text import split

INTEGER = re.compile(r"i(1|8|16|32|64)")
_ARRAY = re.compile(r"\[(\d+) x (.*)\]", re.DOTALL)
_DOUBLE = re.compile(r"0x([0-9A-Fa-f]{16})")
_ESCAPE = re.compile(rb"\\(\\|[0-9A-Fa-f]{2})")
POINTER = 8  # bytes that an address takes in the memory of the code, on every machine


class Unexportable(QuadvisError):
    """Code that has no translation into C here."""


def c_type(text: str) -> str:
    """Return the type of C; Unexportable if there is none here."""
    if match := INTEGER.fullmatch(text):
        return f"uint{max(8, int(match[1]))}_t"
    if text in ("double", "float"):
        return text
    if text == "ptr":
        return "char *"
    raise Unexportable(f"values of the type '{text}' have no translation into C")


def signed(text: str) -> str:
    """Return the signed type of C for a whole number of LLVM's."""
    return c_type(text).removeprefix("u")


def suffix(text: str) -> str:
    """Return the end of the names of functions that load and store a type."""
    if match := INTEGER.fullmatch(text):
        return f"u{max(8, int(match[1]))}"
    return {"double": "f64", "float": "f32", "ptr": "p"}[text]


def size(text: str) -> int:
    """Return the bytes of a type."""
    if match := INTEGER.fullmatch(text):
        return max(8, int(match[1])) // 8
    if text in ("double", "float", "ptr"):
        return {"double": 8, "float": 4, "ptr": POINTER}[text]
    if match := _ARRAY.fullmatch(text):
        return int(match[1]) * size(match[2])
    if text.startswith("{"):
        return offset(text, len(fields(text)))
    raise Unexportable(f"the size of the type '{text}' is not known")


def element(text: str) -> str:
    """Return the type of an array's elements."""
    match = _ARRAY.fullmatch(text)
    if match is None:
        raise Unexportable(f"'{text}' is no array")
    return match[2]


def fields(text: str) -> list[str]:
    """Return the types of a structure's fields."""
    return split(text.strip()[1:-1])


def _alignment(text: str) -> int:
    if match := _ARRAY.fullmatch(text):
        return _alignment(match[2])
    if text.startswith("{"):
        return max((_alignment(each) for each in fields(text)), default=1)
    return size(text)


def offset(text: str, index: int) -> int:
    """Return where a field begins in a structure (bytes); that behind the last is the structure's size."""
    place, types = 0, fields(text)
    for each in types[:index]:
        place = -(-place // _alignment(each)) * _alignment(each) + size(each)
    step = _alignment(types[index]) if index < len(types) else _alignment(text)
    return -(-place // step) * step


def number(kind: str, text: str) -> str:
    """Return a constant number in C; Unexportable if it is none."""
    if text in ("undef", "poison", "zeroinitializer", "null", "none"):
        return "(char *)0" if kind == "ptr" else "0"
    if kind in ("double", "float"):
        value = (
            struct.unpack(">d", bytes.fromhex(found[1]))[0]
            if (found := _DOUBLE.fullmatch(text))
            else float(text)
        )
        return real(value, text)
    if text in ("true", "false"):
        return "1" if text == "true" else "0"
    if re.fullmatch(r"-?\d+", text):
        bits = max(8, int(kind[1:]))
        value = int(text) % 2**bits
        return f"UINT64_C({value})" if bits == 64 else f"{value}u"
    raise Unexportable(f"the constant '{text}' has no translation into C")


def real(value: float, text: str = "") -> str:
    """Return a number of C with the same bits."""
    if value != value or value in (float("inf"), float("-inf")):
        (bits,) = (
            struct.unpack("<Q", struct.pack("<d", value)) if not _DOUBLE.fullmatch(text) else (int(text, 16),)
        )
        return f"from_bits(UINT64_C({bits}))"
    return (
        repr(value)
        if float(repr(value)) == value and abs(value) < 1e15 and value == int(value)
        else value.hex()
    )


def typed(text: str) -> tuple[str, str]:
    """Return the type and the rest of an operand such as "[2 x i64] %a"."""
    depth = 0
    for place, letter in enumerate(text):
        depth += (letter in "[{(<") - (letter in "]})>")
        if letter == " " and not depth:
            return text[:place], text[place + 1 :].strip()
    return text, ""


def leaves(kind: str) -> list[tuple[tuple[int, ...], str]]:
    """Return the scalar parts of a type, each with its indices; of a scalar itself, without any."""
    if kind.startswith("{"):
        parts = fields(kind)
    elif match := _ARRAY.fullmatch(kind):
        parts = [match[2]] * int(match[1])
    else:
        return [((), kind)]
    return [((index, *inner), leaf) for index, part in enumerate(parts) for inner, leaf in leaves(part)]


def place_of(kind: str, path: tuple[int, ...]) -> int:
    """Return where a scalar part lies in a type (bytes)."""
    place = 0
    for index in path:
        if kind.startswith("{"):
            place += offset(kind, index)
            kind = fields(kind)[index]
        else:
            kind = element(kind)
            place += index * size(kind)
    return place


def _escaped(match: re.Match[bytes]) -> bytes:
    return b"\\" if match[1] == b"\\" else bytes((int(match[1], 16),))


def content(kind: str, text: str) -> bytes:
    """Return the bytes of a constant; Unexportable if it holds addresses."""
    if text in ("zeroinitializer", "undef", "poison"):
        return bytes(size(kind))
    if text.startswith('c"'):
        return _ESCAPE.sub(_escaped, text[2:-1].encode("latin-1"))
    if kind in ("double", "float"):
        found = _DOUBLE.fullmatch(text)
        value = struct.unpack(">d", bytes.fromhex(found[1]))[0] if found else float(text)
        return struct.pack("<d" if kind == "double" else "<f", value)
    if INTEGER.fullmatch(kind):
        value = {"true": 1, "false": 0}.get(text)
        return (int(text) if value is None else value).to_bytes(
            size(kind), "little", signed=text.startswith("-")
        )
    if kind == "ptr" and text == "null":
        return bytes(POINTER)
    if text[:1] in "[{":
        found_bytes = bytearray()
        for index, part in enumerate(split(text[1:-1])):
            if kind.startswith("{"):
                found_bytes += bytes(offset(kind, index) - len(found_bytes))
            found_bytes += content(*typed(part))
        return bytes(found_bytes) + bytes(size(kind) - len(found_bytes))
    raise Unexportable(f"the constant '{text[:40]}' has no translation into C")
