"""From values to the bytes of a message."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from quadvis_blocks.hardware._protocol.description import (
    ALL,
    BitField,
    BitRun,
    CounterField,
    FixedBytes,
    IgnoredField,
    NamedValue,
    ProtocolMessage,
    ValueField,
    WireField,
)
from quadvis_blocks.hardware._protocol.forms import LITTLE, Binary, Number, Printed

DIGITS = 2  # hexadecimal ones of a byte


def encode(message: ProtocolMessage, values: Sequence[Any]) -> bytes:
    """Return the bytes of a message of SI values, one for each of the message's ``values``.

    A value that no number on the wire stands for becomes the nearest one that is in its range. ValueError if
    a value is NaN and may not be missing. A counter is 0, what is ignored is 0 or empty.
    """
    waiting = iter(values)
    return sealed(message, b"".join([_bytes_of(each, waiting) for each in message.fields]))


def sealed(message: ProtocolMessage, body: bytes) -> bytes:
    """Return a whole message from its fields as bytes."""
    check = message.check
    if check is None:
        return message.header + body + message.terminator
    covered = message.header + body if check.over == ALL else body
    number, size = check.algorithm.compute(covered), check.algorithm.size
    seal = b"%0*X" % (DIGITS * size, number) if message.is_text else _whole(number, size, check.order)
    return message.header + body + check.mark + seal + message.terminator


def _whole(number: int, size: int, order: str) -> bytes:
    return number.to_bytes(size, "little" if order == LITTLE else "big")


def _bytes_of(each: WireField, waiting: Iterator[Any]) -> bytes:
    if isinstance(each, FixedBytes):
        return each.data
    if isinstance(each, BitField):
        return _packed(each.form, _bits_of(each, waiting))
    if isinstance(each, IgnoredField):
        return bytes(each.size)
    if isinstance(each, CounterField):
        return _packed(each.form, 0) if isinstance(each.form, Binary) else each.form.print(0)
    numbers = [float(number) for number in np.atleast_1d(next(waiting))]
    if isinstance(each.form, Binary):
        return b"".join([_packed(each.form, wire_number(each, number)) for number in numbers])
    return each.between.join([_text(each, number) for number in numbers])


def wire_number(each: ValueField | BitRun, value: float) -> Number:
    """Return the number on the wire that is nearest to an SI value, within the range and the form."""
    named = each.value
    assert named is not None
    if math.isnan(value):
        raise ValueError(f"{named.name} must not be NaN")
    low, high = named.bounds
    least, most = each.limits if isinstance(each, BitRun) else each.form.limits
    number = (min(max(value, low), high) - named.shift) / named.factor
    number = min(max(number, least), most)
    is_whole = isinstance(each, BitRun) or each.form.is_whole
    return _inward(round(number), named) if is_whole else number


def _inward(number: int, named: NamedValue) -> int:
    """Return a whole number; one that rounding has carried over an end of the range is brought back."""
    for way in (0, 1, -1):
        if named.holds((number + way) * named.factor + named.shift):
            return number + way
    return number


def _bits_of(each: BitField, waiting: Iterator[Any]) -> int:
    found = place = 0
    for run in each.runs:
        if run.value is not None:
            number = int(wire_number(run, float(next(waiting))))
            found |= (number & (1 << run.width) - 1) << place
        place += run.width
    return found


def _packed(form: Binary, number: Number) -> bytes:
    return struct.pack(form.prefix + form.code, number)


def _text(each: ValueField, value: float) -> bytes:
    named = each.value
    if named.optional and math.isnan(value):
        return b""
    number = wire_number(each, value)
    if named.words:
        return min(named.words, key=lambda word: abs(named.words[word] - number))
    assert isinstance(each.form, Printed)
    return each.form.print(number)
