r"""Bytes as people write them in a file: "$IMU,", "\r\n", "\xAA\x55", [0xAA, 0x55]."""

from __future__ import annotations

import re

from quadvis.document import YamlList, YamlNode
from quadvis.errors import quoted

MOST = 256  # bytes that are written out
BYTE = 255
ESCAPES = {"r": "\r", "n": "\n", "t": "\t", "0": "\0", "\\": "\\"}
_ESCAPE = re.compile(r"\\(x[0-9A-Fa-f]{2}|.?)", re.DOTALL)
_WHOLE = re.compile(r"[+-]?(?:0x[0-9A-Fa-f]{1,16}|0b[01]{1,64}|0|[1-9][0-9]{0,19})")


def text_bytes(text: str) -> bytes:
    r"""Return the bytes of a text; ValueError says what is wrong with it.

    ``\r``, ``\n``, ``\t``, ``\0``, ``\\`` and ``\xAA`` are known, whether YAML has replaced them or not. So a
    character up to U+00FF is the byte of that number.
    """
    found = _ESCAPE.sub(_escaped, text).encode("latin-1", "replace")
    if max(map(ord, text), default=0) > BYTE:
        odd = next(letter for letter in text if ord(letter) > BYTE)
        raise ValueError(f"{quoted(odd)} is not one byte; write its bytes as \\x.. each")
    if len(found) > MOST:
        raise ValueError(f"these are {len(found)} bytes; at most {MOST} can be written out")
    return found


def _escaped(match: re.Match[str]) -> str:
    code = match[1]
    if code.startswith("x") and len(code) > 1:
        return chr(int(code[1:], 16))
    if code not in ESCAPES:
        raise ValueError(f"'\\{code}' is no byte; write '\\\\' for a backslash")
    return ESCAPES[code]


def bytes_of(node: YamlNode) -> bytes:
    """Return the bytes that a value of a file means: a text, or a list of numbers from 0 to 255."""
    if isinstance(node, YamlList):
        numbers = [whole_number(each) for each in node]
        for each, number in zip(node, numbers, strict=True):
            if not 0 <= number <= BYTE:
                raise each.wrong("a byte, 0 to 255")
        return bytes(numbers)
    try:
        return text_bytes(node.text())
    except ValueError as error:
        problem, _, remedy = str(error).partition("; ")
        raise node.fault(problem, remedy) from None


def whole_number(node: YamlNode) -> int:
    """Return a whole number, which may be written as 0xAA or 0b101."""
    text = node.text()
    if _WHOLE.fullmatch(text) is None:
        raise node.wrong("a whole number, such as 12 or 0x0C")
    return int(text, 0)
