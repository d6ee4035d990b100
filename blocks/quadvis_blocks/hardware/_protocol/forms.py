"""How a number stands on the wire: as bytes in an order, or as text by a format of C's printf."""

from __future__ import annotations

import re
from typing import NamedTuple

LITTLE, BIG = "little", "big"
ORDERS = (LITTLE, BIG)
CODES = {
    "u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "u64": "Q", "i64": "q",
    "f32": "f", "f64": "d",
}  # fmt: skip
BITS = 8
SINGLE = 3.4028234663852886e38  # the largest f32
DOUBLE = 1.7976931348623157e308
SINGLE_STEP, STEP = 1.2e-7, 1e-12  # by which rounding moves a number, as a share of it; of f64 with our own
WIDEST = 40  # characters of a number
LARGEST = 1e15  # of a number in text, so that it has no more characters than that

FORMAT = re.compile(r"%[-+ 0]*(?P<width>[0-9]{0,2})(?:\.(?P<digits>[0-9]{1,2}))?(?P<kind>[diufFeEgGxX])")
# All possessive: a number that has matched is not tried again in another way, so no line takes long.
_BLANKS = rb"[ ]{0,40}+"
_WHOLE = rb"[-+]?[0-9]{1,20}+"
_DECIMAL = rb"[-+]?(?:[0-9]{1,20}+(?:\.[0-9]{0,20}+)?+|\.[0-9]{1,20}+)"
_FLOATING = _DECIMAL + rb"(?:[eE][-+]?[0-9]{1,3}+)?+"
_HEXADECIMAL = rb"[0-9A-Fa-f]{1,16}+"


class Binary(NamedTuple):
    """A number of a fixed count of bytes: ``type`` is one of u8, i8, u16 ... i64, f32, f64."""

    type: str
    order: str = LITTLE

    @property
    def size(self) -> int:
        """Its bytes."""
        return int(self.type[1:]) // BITS

    @property
    def is_whole(self) -> bool:
        """True of a whole number."""
        return not self.type.startswith("f")

    @property
    def code(self) -> str:
        """The letter of Python's module struct, without the order."""
        return CODES[self.type]

    @property
    def prefix(self) -> str:
        """The order, as the module struct writes it."""
        return "<" if self.order == LITTLE else ">"

    @property
    def slack(self) -> tuple[float, float]:
        """By how much a rounded number may be beyond its range: on the wire, and as a share of its bound."""
        return 0.0, SINGLE_STEP if self.type == "f32" else STEP

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest number."""
        bits = self.size * BITS
        if not self.is_whole:
            most = SINGLE if self.type == "f32" else DOUBLE
            return -most, most
        return (0, (1 << bits) - 1) if self.type.startswith("u") else (-(1 << bits - 1), (1 << bits - 1) - 1)


class Printed(NamedTuple):
    """A number in text: ``format`` is one of C, such as %.4f, %d or %04X."""

    format: str

    @property
    def kind(self) -> str:
        """The letter at the end: d, f, e, g or x."""
        letter = self.format[-1].lower()
        return "d" if letter in "iu" else letter

    @property
    def is_whole(self) -> bool:
        """True of a whole number."""
        return self.kind in "dx"

    def pattern(self, behind: bytes) -> bytes:
        """Return the regular expression of its text, with the digits as its one group.

        Blanks may stand around it, if not those with which the text ``behind`` it begins.
        """
        digits = {"d": _WHOLE, "f": _DECIMAL, "x": _HEXADECIMAL}.get(self.kind, _FLOATING)
        return _BLANKS + rb"(" + digits + rb")" + (b"" if behind.startswith(b" ") else _BLANKS)

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest number that is printed."""
        return (0.0 if self.kind == "x" else -LARGEST), LARGEST

    @property
    def slack(self) -> tuple[float, float]:
        """By how much a rounded number may be beyond its range: on the wire, and as a share of its bound."""
        if self.is_whole:
            return 0.0, STEP
        match = FORMAT.fullmatch(self.format)
        assert match is not None
        last = 0.5 * 10.0 ** -int(match["digits"] or 6)
        return (last, STEP) if self.kind == "f" else (0.0, 10 * last)

    def print(self, number: float) -> bytes:
        """Return the text of a number."""
        return (self.format % (int(number) if self.is_whole else number)).encode()

    def parse(self, text: bytes) -> float:
        """Return the number of a text that fits the pattern."""
        if self.is_whole:
            return int(text, 16 if self.kind == "x" else 10)
        return float(text)


Form = Binary | Printed
Number = float | int


def printed(text: str) -> Printed:
    """Return the form of a format; ValueError if C has no such format for one number."""
    match = FORMAT.fullmatch(text)
    if match is None or int(match["width"] or 0) > WIDEST or int(match["digits"] or 0) > WIDEST // 2:
        raise ValueError(text)
    return Printed(text)
