"""Messages that a diagram describes by itself: by a format of C's printf, or one of Python's module struct.

``%f,%f`` are two numbers in a line of text, as xPC Target's blocks for RS-232 have them; ``<3hB`` are three
i16 and one u8, as its blocks Pack and Unpack have them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from quadvis.block import ParameterError
from quadvis.errors import sentence, suggestion
from quadvis.units import Unit, UnitError, read_quantity
from quadvis_blocks.hardware._protocol.bytes_written import text_bytes
from quadvis_blocks.hardware._protocol.checksums import AMBIGUOUS, NAMES, NONE, algorithm
from quadvis_blocks.hardware._protocol.description import (
    LONGEST,
    Check,
    FixedBytes,
    IgnoredField,
    NamedValue,
    ProtocolMessage,
    ValueField,
    WireField,
)
from quadvis_blocks.hardware._protocol.forms import BIG, LITTLE, Binary, printed

STRUCT = {
    "b": "i8", "B": "u8", "h": "i16", "H": "u16", "i": "i32", "I": "u32", "l": "i32", "L": "u32",
    "q": "i64", "Q": "u64", "f": "f32", "d": "f64",
}  # fmt: skip
ORDER = {"<": LITTLE, ">": BIG, "!": BIG}
MOST = 256
TWICE = "it stands inside of it, too"
_CODE = re.compile(r"(?P<count>[0-9]{0,3})(?P<code>[a-zA-Z?])|(?P<blank>\s+)")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
_PIECE = re.compile(r"%[^%a-zA-Z]*[a-zA-Z]|%%|[^%]+|%")


class WrittenMessage(NamedTuple):
    """A message as a diagram writes it; ``names``, ``units`` and ``ranges`` have blanks between them."""

    format: str
    names: str
    units: str
    ranges: str
    header: str
    terminator: str
    checksum: str


def message_of(written: WrittenMessage) -> ProtocolMessage:
    """Return the message; ParameterError names the parameter that is wrong."""
    is_text = "%" in written.format
    header, terminator = (_bytes(name, getattr(written, name)) for name in ("header", "terminator"))
    if is_text and not terminator:
        raise ParameterError("terminator", "terminator is missing; write such as terminator: '\\r\\n'")
    fields = list(_text_fields(written.format) if is_text else _struct_fields(written.format))
    count = sum(isinstance(each, ValueField) for each in fields)
    values = iter(_values(written, count))
    named = [
        replace(each, value=_merged(next(values), each)) if isinstance(each, ValueField) else each
        for each in fields
    ]
    order = ORDER.get(written.format[:1], BIG)
    check = _check(written.checksum, is_text, order)
    made = ProtocolMessage("format", is_text, header, tuple(named), check, terminator)
    if made.size > LONGEST:
        raise ParameterError("format", f"format has {made.size} bytes; a message has {LONGEST} at most")
    if is_text and made.terminated_inside:
        raise ParameterError("terminator", f"terminator must end the message, and {TWICE}")
    return made


def _bytes(name: str, text: str) -> bytes:
    try:
        return text_bytes(text)
    except ValueError as error:
        raise ParameterError(name, f"{name} must be bytes: {error}") from None


def _check(name: str, is_text: bool, order: str) -> Check | None:
    if name == NONE:
        return None
    if name not in NAMES:
        several = f"write {' or '.join(AMBIGUOUS[name])}" if name in AMBIGUOUS else ""
        remedy = several or suggestion(name, (*NAMES, NONE)) or "write 'none' if the messages have none"
        raise ParameterError("checksum", sentence(f"there is no checksum '{name}'", remedy))
    return Check(algorithm(name), order=order, mark=b"*" if is_text else b"")


def _text_fields(text: str) -> Iterator[WireField]:
    is_number = False
    for piece in _PIECE.findall(text):
        if piece == "%%" or not piece.startswith("%"):
            is_number = False
            yield FixedBytes(_bytes("format", piece.replace("%%", "%")))
            continue
        if is_number:
            raise ParameterError("format", f"nothing stands between two numbers in '{text}'; write %f,%f")
        is_number = True
        try:
            form = printed(piece)
        except ValueError:
            raise ParameterError(
                "format", f"'{piece}' is no format of one number; write such as %.3f"
            ) from None
        yield ValueField(form, NamedValue("", whole=form.is_whole))


def _struct_fields(text: str) -> Iterator[WireField]:
    if text[:1] not in ORDER:
        problem = "format must begin with the order of the bytes, or be text such as %f,%f"
        raise ParameterError(
            "format", sentence(problem, f"write '<{text}' for little, '>{text}' for big endian")
        )
    order, at = ORDER[text[0]], 1
    while at < len(text):
        match = _CODE.match(text, at)
        code = match["code"] if match is not None else None
        if match is None or (code is not None and code != "x" and code not in STRUCT):
            problem = f"'{code or text[at]}' in '{text}' is no number of Python's module struct"
            raise ParameterError("format", sentence(problem, f"use x and {', '.join(STRUCT)}"))
        at = match.end()
        if code is None:
            continue
        count = int(match["count"] or 1)
        if not 0 < count <= MOST:
            raise ParameterError("format", f"{count} numbers in '{text}' are not 1 to {MOST}")
        if code == "x":
            yield IgnoredField(count)
            continue
        form = Binary(STRUCT[code], order)
        whole = form.is_whole and form.type != "u64"
        yield ValueField(form, NamedValue("", elements=count if match["count"] else 0, whole=whole))


def _values(written: WrittenMessage, count: int) -> list[NamedValue]:
    """Return the values that the names, the units and the ranges describe."""
    names = written.names.split()
    if len(names) != count or not count:
        problem = f"names must be {count} names for the numbers of '{written.format}', got {len(names)}"
        raise ParameterError("names" if count else "format", problem)
    for name in names:
        if _NAME.fullmatch(name) is None or names.count(name) > 1:
            problem = f"'{name}' in names is no name, or there twice"
            raise ParameterError("names", sentence(problem, "use letters, digits and '_'"))
    units, ranges = (_each(written, what, count) for what in ("units", "ranges"))
    return [_value(*each) for each in zip(names, units, ranges, strict=True)]


def _each(written: WrittenMessage, what: str, count: int) -> Sequence[str]:
    found = str(getattr(written, what)).split() or [""]
    if len(found) not in (1, count):
        raise ParameterError(what, f"{what} must be one for all names, or {count}, got {len(found)}")
    return found * (count if len(found) == 1 else 1)


def _value(name: str, unit: str, limits: str) -> NamedValue:
    try:
        measured = Unit.parse(unit or "1")
    except UnitError as error:
        raise ParameterError("units", str(error)) from None
    low = high = None
    if limits:
        low, high = (bound * measured.scale for bound in _range(limits, measured))
    return NamedValue(
        name, measured.si, factor=measured.scale, lowest=low, highest=high,
        whole=not measured.dimension and measured.scale == 1.0,
    )  # fmt: skip


def _range(text: str, unit: Unit) -> tuple[float, float]:
    try:
        low, high = (read_quantity(bound, unit) for bound in text.split(".."))
    except ValueError as error:
        raise ParameterError("ranges", f"'{text}' in ranges is no range; write such as -180..180") from error
    except UnitError as error:
        raise ParameterError("ranges", str(error)) from None
    if not low < high:
        raise ParameterError("ranges", f"'{text}' in ranges is empty; write the lower number first")
    return low, high


def _merged(value: NamedValue, each: ValueField) -> NamedValue:
    return replace(value, elements=each.value.elements, whole=value.whole and each.value.whole)
