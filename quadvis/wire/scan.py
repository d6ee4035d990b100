"""Look through a msgpack message before it is unpacked: one of 0.5 MB can hold half a million empty maps.

The costs are bounded by the number of values, not of bytes. Accepted is what JSON could say, and byte
strings: no extension types, no times, no keys that are not text.
"""

from __future__ import annotations

from quadvis.wire.limits import DEPTH, ITEMS, REQUEST, TEXT
from quadvis.wire.refusals import BadError

_VALUE, _TEXT, _BYTES, _LIST, _MAP = range(5)


def _forms() -> list[tuple[int, int, int] | None]:
    """Return for each first byte: the kind of value, the bytes of its length, and its own length or more."""
    forms: list[tuple[int, int, int] | None] = [None] * 256
    for byte in (*range(0x80), *range(0xE0, 0x100), 0xC0, 0xC2, 0xC3):
        forms[byte] = (_VALUE, 0, 0)
    for byte, length in ((0xCA, 4), (0xCB, 8), *((0xCC + n, 1 << n) for n in range(4))):
        forms[byte] = (_VALUE, 0, length)
    for byte, length in ((0xD0 + n, 1 << n) for n in range(4)):
        forms[byte] = (_VALUE, 0, length)
    for n in range(16):
        forms[0x80 + n], forms[0x90 + n] = (_MAP, 0, n), (_LIST, 0, n)
    for n in range(32):
        forms[0xA0 + n] = (_TEXT, 0, n)
    for n in range(3):
        forms[0xC4 + n], forms[0xD9 + n] = (_BYTES, 1 << n, 0), (_TEXT, 1 << n, 0)
    for n in range(2):
        forms[0xDC + n], forms[0xDE + n] = (_LIST, 2 << n, 0), (_MAP, 2 << n, 0)
    return forms


_FORMS = _forms()


def scan(
    data: bytes, *, most: int = REQUEST, items: int = ITEMS, depth: int = DEPTH, text: int = TEXT
) -> int:
    """Return the number of values in a message; BadError if it is not one whole value within the limits."""
    size = len(data)
    if size > most:
        raise BadError(f"the message has {size} bytes, more than {most}")
    position = count = 0
    open_lists: list[list[int]] = [[1, 0]]  # values that are still to come, and whether each second is a key
    while open_lists:
        top = open_lists[-1]
        if not top[0]:
            open_lists.pop()
            continue
        if position >= size:
            raise BadError("the message ends in the middle of a value")
        form = _FORMS[data[position]]
        if form is None:
            raise BadError(f"the message has a value of a type that is not used here, at byte {position}")
        kind, width, length = form
        if top[1] and not top[0] % 2 and kind != _TEXT:
            raise BadError("the message has a map with a key that is no text")
        top[0] -= 1
        count += 1
        position += 1
        if width:
            length = int.from_bytes(data[position : position + width], "big")
            position += width
        if kind in (_LIST, _MAP):
            waiting = 2 * length if kind == _MAP else length
            if waiting > items:
                raise BadError(f"the message has more than {items} values")
            open_lists.append([waiting, int(kind == _MAP)])
            if len(open_lists) > depth + 1:
                raise BadError(f"the message has more than {depth} lists and maps inside one another")
        else:
            position += length
            if kind == _TEXT and length > text:
                raise BadError(f"the message has a text of more than {text} bytes")
        if count > items:
            raise BadError(f"the message has more than {items} values")
    if position != size:
        raise BadError(
            "the message ends in the middle of a value"
            if position > size
            else "the message has more than one value"
        )
    return count
