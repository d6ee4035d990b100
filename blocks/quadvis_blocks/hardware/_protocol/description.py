"""What a message of a protocol is made of: its fields in the order of the wire, its ends, its checksum.

A value on the wire is a number; the signal of a block is ``offset + scale x number`` in the field's unit, as
an SI value.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, TypeGuard

from quadvis.block import Line
from quadvis.errors import Place
from quadvis.units import Unit
from quadvis_blocks.hardware._protocol.checksums import Algorithm
from quadvis_blocks.hardware._protocol.forms import STEP, Binary, Form

NOWHERE = Place("")
LONGEST = 1024  # bytes of a message
BODY, ALL = "body", "all"
NUMERALS = b"0123456789+-. abcdefABCDEF"  # of numbers in text
WHOLE = 2.0**63 - 1024  # the largest float that an int64 holds


@dataclass(frozen=True)
class FixedBytes:
    """Bytes that are the same in every message."""

    data: bytes

    @property
    def size(self) -> int:
        """Its bytes."""
        return len(self.data)


@dataclass(frozen=True)
class NamedValue:
    """A value with a name, which is a signal of a block.

    ``elements`` is the length of an array, 0 of a single value. ``factor`` and ``shift`` make an SI value of
    a number on the wire; ``lowest`` and ``highest`` are the least and the greatest SI value, None if the
    protocol says none. ``words`` are numbers by the texts that stand for them. An ``optional`` value is NaN
    if its text is empty. A ``whole`` value is an int64.
    """

    name: str
    unit: Unit = field(default_factory=Unit)
    doc: str = ""
    elements: int = 0
    factor: float = 1.0
    shift: float = 0.0
    lowest: float | None = None
    highest: float | None = None
    words: Mapping[bytes, int] = field(default_factory=dict)
    optional: bool = False
    whole: bool = False
    place: Place = field(default=NOWHERE, compare=False)

    @property
    def count(self) -> int:
        """The count of its numbers on the wire."""
        return self.elements or 1

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the greatest SI value."""
        most = WHOLE if self.whole else math.inf
        return (
            -most if self.lowest is None else self.lowest,
            most if self.highest is None else self.highest,
        )

    def holds(self, value: float) -> bool:
        """Return whether a value is in the range, but for what the conversion rounds."""
        low, high = self.bounds
        return low - STEP * abs(low) <= value <= high + STEP * abs(high)

    @property
    def type(self) -> str:
        """The type of its port."""
        kind = "int64" if self.whole else "float64"
        return f"{kind}[{self.elements}]" if self.elements else kind


@dataclass(frozen=True)
class ValueField:
    """A value, in one form for all its elements; in text ``between`` stands between two of them."""

    form: Form
    value: NamedValue
    between: bytes = b""

    @property
    def size(self) -> int:
        """Its bytes, at least."""
        if isinstance(self.form, Binary):
            return self.value.count * self.form.size
        shortest = 0 if self.value.optional else min(map(len, self.value.words), default=1)
        return self.value.count * shortest + (self.value.count - 1) * len(self.between)


@dataclass(frozen=True)
class BitRun:
    """Some bits of a whole number: a value, or nothing that is read; ``signed`` in two's complement."""

    width: int
    value: NamedValue | None
    signed: bool = False

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest number."""
        if self.signed:
            return -(1 << self.width - 1), (1 << self.width - 1) - 1
        return 0, (1 << self.width) - 1


@dataclass(frozen=True)
class BitField:
    """A whole number without sign that holds several values, that of the lowest bits first."""

    form: Binary
    runs: tuple[BitRun, ...]

    @property
    def size(self) -> int:
        """Its bytes."""
        return self.form.size


@dataclass(frozen=True)
class CounterField:
    """A number that counts the messages of its kind: 0 to ``modulus`` - 1, then 0 again."""

    form: Form
    modulus: int

    @property
    def size(self) -> int:
        """Its bytes, at least."""
        return self.form.size if isinstance(self.form, Binary) else 1


@dataclass(frozen=True)
class IgnoredField:
    """What is not read: ``size`` bytes, or in text all up to what follows (``size`` 0)."""

    size: int = 0


WireField = FixedBytes | ValueField | BitField | CounterField | IgnoredField


class Check(NamedTuple):
    """A checksum: how it is computed, over what, and how it stands on the wire.

    ``over`` is "body", from behind the header to the checksum, or "all", with the header. In text
    it stands behind ``mark`` as hexadecimal digits, else as a number in ``order``.
    """

    algorithm: Algorithm
    over: str = BODY
    order: str = "big"
    mark: bytes = b""


class FrameId(NamedTuple):
    """The identifier of a frame on a CAN bus: of 11 bits, or of 29 if it is ``extended``."""

    number: int
    extended: bool = False


@dataclass(frozen=True)
class ProtocolMessage:
    """A message: its header, its fields in the order of the wire, its checksum if it has one, its terminator.

    In text, what stands between fields is a `FixedBytes` among them. A message with a ``frame_id`` is a frame
    on a CAN bus, which has neither header nor terminator.
    """

    name: str
    is_text: bool
    header: bytes
    fields: tuple[WireField, ...]
    check: Check | None
    terminator: bytes
    doc: str = ""
    request: bytes = b""  # sent at each step of the block that reads it
    frame_id: FrameId | None = None
    place: Place = field(default=NOWHERE, compare=False)

    @cached_property
    def values(self) -> tuple[NamedValue, ...]:
        """The values in the order of the wire."""
        return tuple(value for each in self.fields for value in values_of(each))

    @cached_property
    def prefix(self) -> bytes:
        """The bytes by which it begins."""
        found = self.header
        for each in self.fields:
            if not isinstance(each, FixedBytes):
                break
            found += each.data
        return found

    @property
    def modulus(self) -> int:
        """That of its counter; 0 if it has none."""
        return next((each.modulus for each in self.fields if isinstance(each, CounterField)), 0)

    @cached_property
    def size(self) -> int:
        """The bytes of a binary message; of text, the least that it can have."""
        checked = 0
        if self.check is not None:
            checked = len(self.check.mark) + self.check.algorithm.size * (2 if self.is_text else 1)
        return len(self.header) + sum(each.size for each in self.fields) + checked + len(self.terminator)

    def limits(self, value: NamedValue) -> tuple[float, float]:
        """Return the least and the greatest SI value that can be sent; infinite if nothing limits it."""
        low, high = self._form_limits(value)
        ends = sorted(end * value.factor + value.shift for end in (low, high))
        lowest = -math.inf if value.lowest is None else value.lowest
        highest = math.inf if value.highest is None else value.highest
        return max(lowest, ends[0]), min(highest, ends[1])

    def _form_limits(self, value: NamedValue) -> tuple[float, float]:
        """Return the least and the greatest number on the wire, of a whole one, or one that words mean."""
        if value.words:
            return min(value.words.values()), max(value.words.values())
        for each in self.fields:
            if isinstance(each, BitField):
                found = [run.limits for run in each.runs if run.value == value]
            else:
                found = [each.form.limits] if is_whole_binary(each) and value in values_of(each) else []
            if found:
                return found[0]
        return -math.inf, math.inf

    @property
    def terminated_inside(self) -> bool:
        """Whether its terminator, of text, could come before its end."""
        inside = [self.header] + ([self.check.mark] if self.check is not None else [])
        for each in self.fields:
            inside += [each.data] if isinstance(each, FixedBytes) else []
            inside += [each.between, *each.value.words] if isinstance(each, ValueField) else []
        return self.terminator[:1] in NUMERALS or any(self.terminator in piece for piece in inside)

    @property
    def is_marked(self) -> bool:
        """Whether it can be found in a stream: by fixed bytes, or by a checksum."""
        return bool(self.header or self.terminator or self.check or self.prefix)


def values_of(each: WireField) -> list[NamedValue]:
    """Return the values of a field."""
    if isinstance(each, BitField):
        return [run.value for run in each.runs if run.value is not None]
    return [each.value] if isinstance(each, ValueField) else []


def is_whole_binary(each: WireField) -> TypeGuard[ValueField]:
    """Return whether a field is a whole number in bytes."""
    return isinstance(each, ValueField) and isinstance(each.form, Binary) and each.form.is_whole


@dataclass(frozen=True)
class DeviceProtocol:
    """The messages of a device by name, its line (None: the file does not say), what is sent at both ends."""

    name: str
    messages: Mapping[str, ProtocolMessage]
    line: Line | None = None
    initialise: tuple[bytes, ...] = ()
    terminate: tuple[bytes, ...] = ()
    doc: str = ""
