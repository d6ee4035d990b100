"""From the bytes of a whole message to its values."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any, NamedTuple

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
from quadvis_blocks.hardware._protocol.encode import DIGITS
from quadvis_blocks.hardware._protocol.forms import Binary, Number, Printed


class Damage(Enum):
    """Why bytes that have the form of a message give no values."""

    CHECKSUM = "the checksum is wrong"
    VALUE = "a value is not finite, or beyond its range"


class Decoded(NamedTuple):
    """What a message says: the values of its signals, and its counter (-1: it has none)."""

    values: tuple[Any, ...]
    counter: int = -1


Raw = Sequence[Any]  # the numbers of a message as they stand on the wire; None is an empty text
Reading = Callable[[Raw], Any]  # the value of one signal; None if it must be refused
Decoding = Callable[[bytes], Decoded | Damage | None]


def decoding(message: ProtocolMessage) -> Decoding:
    """Return the function that decodes a message of which all bytes are there.

    It returns None if the bytes have not the form of the message.
    """
    return _text_decoding(message) if message.is_text else _binary_decoding(message)


def _readings(message: ProtocolMessage) -> tuple[list[Reading], int]:
    """Return how each signal is read from the numbers on the wire, and which number is the counter."""
    readings: list[Reading] = []
    counter, at = -1, 0
    for each in message.fields:
        if isinstance(each, ValueField):
            readings.append(_value_reading(each, at))
            at += each.value.count
        elif isinstance(each, BitField):
            place = 0
            for run in each.runs:
                if run.value is not None:
                    readings.append(_bit_reading(run, run.value, at, place))
                place += run.width
            at += 1
        elif isinstance(each, CounterField):
            counter, at = at, at + 1
    return readings, counter


def _value_reading(each: ValueField, at: int) -> Reading:
    value_of, last = _converting(each.value, each.form.slack), at + each.value.count
    if not each.value.elements:
        return lambda raw: value_of(raw[at])
    kind = np.int64 if each.value.whole else np.float64

    def array_of(raw: Raw) -> Any:
        values = [value_of(number) for number in raw[at:last]]
        return None if None in values else np.array(values, kind)

    return array_of


def _bit_reading(run: BitRun, named: NamedValue, at: int, place: int) -> Reading:
    value_of, mask, sign = _converting(named, (0.0, 0.0)), (1 << run.width) - 1, 1 << run.width - 1
    if not run.signed:
        return lambda raw: value_of(raw[at] >> place & mask)
    return lambda raw: value_of(((raw[at] >> place & mask) ^ sign) - sign)


def _converting(named: NamedValue, slack: tuple[float, float]) -> Callable[[Number | None], Any]:
    """Return the function from a number on the wire to an SI value; None if it must be refused."""
    factor, shift, whole = named.factor, named.shift, named.whole
    low, high = named.bounds
    room = abs(factor) * slack[0]
    low -= room + slack[1] * abs(low) if math.isfinite(low) else 0.0
    high += room + slack[1] * abs(high) if math.isfinite(high) else 0.0

    def value_of(number: Number | None) -> Any:
        if number is None:
            return math.nan
        value = number if whole else number * factor + shift
        return value if low <= value <= high and -math.inf < value < math.inf else None

    return value_of


def _said(raw: Raw, readings: Sequence[Reading], counter: int) -> Decoded | Damage:
    values = tuple([read(raw) for read in readings])
    for value in values:
        if value is None:
            return Damage.VALUE
    return Decoded(values, -1 if counter < 0 else int(raw[counter]))


def _binary_decoding(message: ProtocolMessage) -> Decoding:
    readings, counter = _readings(message)
    fixed, unpacks = _layout(message)
    check, size, ends = message.check, message.size, message.terminator
    begin = 0 if check is not None and check.over == ALL else len(message.header)
    seal = size - len(ends) - (check.algorithm.size if check is not None else 0)

    def decode(data: bytes) -> Decoded | Damage | None:
        if len(data) != size or not data.endswith(ends):
            return None
        for first, last, wanted in fixed:
            if data[first:last] != wanted:
                return None
        if check is not None:
            order: Any = check.order
            given = int.from_bytes(data[seal : seal + check.algorithm.size], order)
            if check.algorithm.compute(data[begin:seal]) != given:
                return Damage.CHECKSUM
        raw: Raw = ()
        for unpack, at in unpacks:
            raw = (*raw, *unpack(data, at))
        return _said(raw, readings, counter)

    return decode


Unpack = Callable[[bytes, int], tuple[Any, ...]]


def _layout(message: ProtocolMessage) -> tuple[list[tuple[int, int, bytes]], list[tuple[Unpack, int]]]:
    """Return where fixed bytes stand, and the functions that unpack the numbers between them."""
    fixed = [(0, len(message.header), message.header)]
    runs: list[tuple[str, int]] = []  # formats of the module struct, and where they begin
    at = len(message.header)
    for each in message.fields:
        size = each.size
        code = f"{size}x"
        if isinstance(each, FixedBytes):
            fixed.append((at, at + size, each.data))
        elif not isinstance(each, IgnoredField):
            assert isinstance(each.form, Binary)
            code = f"{size // each.form.size}{each.form.code}"
            if not runs or runs[-1][0][0] != each.form.prefix:
                runs.append((each.form.prefix, at))
        if runs:
            runs[-1] = runs[-1][0] + code, runs[-1][1]
        at += size
    return fixed, [(struct.Struct(code).unpack_from, begin) for code, begin in runs]


def _text_decoding(message: ProtocolMessage) -> Decoding:
    readings, counter = _readings(message)
    parses = [parse for each in message.fields for parse in _parses(each)]
    match, check = re.compile(pattern(message), re.DOTALL).fullmatch, message.check
    begin = 0 if check is not None and check.over == ALL else len(message.header)
    behind = len(message.terminator)
    if check is not None:
        behind += DIGITS * check.algorithm.size + len(check.mark)

    def decode(data: bytes) -> Decoded | Damage | None:
        found = match(data)
        if found is None:
            return None
        texts = found.groups()
        if check is not None and check.algorithm.compute(data[begin:-behind]) != int(texts[-1], 16):
            return Damage.CHECKSUM
        raw = [parse(text) if text else None for parse, text in zip(parses, texts, strict=False)]
        return _said(raw, readings, counter)

    return decode


def _parses(each: WireField) -> list[Callable[[bytes], Number]]:
    """Return what makes numbers of the groups of a field's pattern."""
    if isinstance(each, ValueField):
        if each.value.words:
            return [each.value.words.__getitem__]
        assert isinstance(each.form, Printed)
        return [each.form.parse] * each.value.count
    if isinstance(each, CounterField):
        assert isinstance(each.form, Printed)
        return [each.form.parse]
    return []


def pattern(message: ProtocolMessage) -> bytes:
    """Return the regular expression of a line; its groups are the numbers, and the checksum's digits."""
    mark = message.check.mark if message.check is not None else b""
    stops = b"".join([each.data[:1] for each in message.fields if isinstance(each, FixedBytes)])
    stops += message.terminator[:1] + mark[:1]
    found = re.escape(message.header)
    for number, each in enumerate(message.fields):
        after = message.fields[number + 1 : number + 2]
        behind = after[0].data if after and isinstance(after[0], FixedBytes) else mark or message.terminator
        if isinstance(each, FixedBytes):
            found += re.escape(each.data)
        elif isinstance(each, ValueField):
            ones = [_one(each, each.between)] * (each.value.count - 1) + [_one(each, behind)]
            found += re.escape(each.between).join(ones)
        elif isinstance(each, CounterField):
            assert isinstance(each.form, Printed)
            found += each.form.pattern(behind)
        else:
            found += b"[^" + re.escape(stops) + b"]*+"
    if message.check is not None:
        digits = DIGITS * message.check.algorithm.size
        found += re.escape(mark) + b"([0-9A-Fa-f]{%d})" % digits
    return found + re.escape(message.terminator)


def _one(each: ValueField, behind: bytes) -> bytes:
    if each.value.words:
        words = b"(" + b"|".join(map(re.escape, each.value.words)) + b")"
    else:
        assert isinstance(each.form, Printed)
        words = each.form.pattern(behind)
    return b"(?:" + words + b")?" if each.value.optional else words
