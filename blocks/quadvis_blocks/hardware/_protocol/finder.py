"""Finds the messages of a protocol in bytes that come in pieces of any length.

After bytes that are no whole message the search goes on one byte later, inside of them: a message that begins
within a damaged one is found. What a message says does not depend on where the pieces end.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from quadvis.block import Counted
from quadvis_blocks.hardware._protocol.damage import DamageCount, damage_count
from quadvis_blocks.hardware._protocol.decode import Damage, decoding
from quadvis_blocks.hardware._protocol.description import ALL, LONGEST, ProtocolMessage
from quadvis_blocks.hardware._protocol.encode import DIGITS

Values = tuple[Any, ...]


class _Seen(NamedTuple):
    """Bytes at a place: how many belong to a message (0: none begins here, -1: that is not known yet)."""

    length: int
    found: Any = None


NOT_HERE, WAIT = _Seen(0), _Seen(-1)
Look = Callable[[bytearray, int], _Seen]


class Finder:
    """Finds the messages of one kind, ``wanted``; the ``others`` are those that may come on the same line."""

    def __init__(self, wanted: ProtocolMessage, others: Sequence[ProtocolMessage] = ()) -> None:
        looks = [_look(wanted)]
        looks += [_unwanted(_look(other)) for other in others]
        looks += [_unwanted(_any_line(wanted))] if _is_sealed_line(wanted) else []
        self._looks = looks
        starts = {message.prefix for message in (wanted, *others)}
        starts |= {wanted.header} if _is_sealed_line(wanted) else set()
        self._next = re.compile(b"|".join(map(re.escape, sorted(starts, key=len)))).search
        self._longest_start = max(map(len, starts))
        self._gap = Gap(wanted.modulus)
        self._damage: DamageCount = damage_count(wanted)

    def take(self, received: bytearray, *, is_whole: bool = False) -> Iterator[Values | Counted]:
        """Take whole messages off the beginning of ``received``; leave there what may become one.

        ``is_whole`` says that nothing belongs to these bytes that is still to come, as with a datagram.
        Yield values, ``Counted.OTHER``, or for each damaged or missing message what it counts as.
        """
        at, end = 0, len(received)
        is_spoilt = False
        while at < end:
            begin = self._begin(received, at, is_whole)
            seen = self._see(received, begin) if begin < end else WAIT
            waits = seen is WAIT and not is_whole
            good = begin if seen.length > 0 or waits else min(begin + 1, end)
            if good > at and not is_whole:
                yield from [Counted.REFUSED] * self._damage.reject(received, at, good)
            is_spoilt |= good > at and is_whole
            if waits:
                at = good
                break
            if seen.length > 0:
                yield from self._found(seen.found)
            at = good + max(seen.length, 0)
        del received[:at]
        if is_spoilt:
            yield Counted.REFUSED

    def _begin(self, received: bytearray, at: int, is_whole: bool) -> int:
        """Return the next place at which a message may begin; at the end its first bytes may be missing."""
        found = self._next(received, at)
        if found is not None:
            return found.start()
        return len(received) if is_whole else max(at, len(received) - self._longest_start + 1)

    def _see(self, received: bytearray, at: int) -> _Seen:
        """Return the message at a place; if the bytes fit the beginning of one, that is waited for."""
        waits = False
        for look in self._looks:
            seen = look(received, at)
            if seen.length > 0:
                return seen
            waits |= seen is WAIT
        return WAIT if waits else NOT_HERE

    def _found(self, found: Any) -> Iterator[Values | Counted]:
        yield from [Counted.REFUSED] * self._damage.close()
        if found is Damage.VALUE:
            yield Counted.REFUSED
        elif found is Counted.OTHER:
            yield found
        else:
            yield from [Counted.LOST] * self._gap.before(found.counter)
            yield found.values


class Gap:
    """Counts the messages that are missing, by the numbers that the others have: 0 to ``modulus`` - 1."""

    def __init__(self, modulus: int) -> None:
        self._modulus, self._last = modulus, -1

    def before(self, number: int) -> int:
        """Return how many are missing before a message; a sender that began anew has missed none.

        -1 is a message without a number.
        """
        if number < 0:
            return 0
        ahead = (number - self._last) % self._modulus
        missing = ahead - 1 if self._last >= 0 and 0 < ahead <= self._modulus // 2 else 0
        self._last = number
        return missing


def _look(message: ProtocolMessage) -> Look:
    return _line_look(message) if message.is_text else _binary_look(message)


def _binary_look(message: ProtocolMessage) -> Look:
    decode, size, prefix = decoding(message), message.size, message.prefix
    is_sealed = message.check is not None

    def look(received: bytearray, at: int) -> _Seen:
        if received[at : at + len(prefix)] != prefix[: len(received) - at]:
            return NOT_HERE
        if len(received) - at < size:
            return WAIT
        found = decode(bytes(received[at : at + size]))
        if found is None or found is Damage.CHECKSUM or (found is Damage.VALUE and not is_sealed):
            return NOT_HERE
        return _Seen(size, found)

    return look


UNPRINTABLE = re.compile(rb"[^\x20-\x7e\t]")


def _line_end(received: bytearray, at: int, end: bytes) -> int:
    """Return the place behind a line; 0 if this is none, -1 if it may become one."""
    last = at + LONGEST
    found = received.find(end, at, last)
    odd = UNPRINTABLE.search(received, at, last if found < 0 else found)
    if found >= 0:
        return found + len(end) if odd is None else 0
    if odd is not None and not end.startswith(bytes(received[odd.start() :])):
        return 0
    return -1 if len(received) < last else 0


def _line_look(message: ProtocolMessage) -> Look:
    decode, prefix, end, body = decoding(message), message.prefix, message.terminator, len(message.prefix)
    is_sealed = message.check is not None

    def look(received: bytearray, at: int) -> _Seen:
        if received[at : at + body] != prefix[: len(received) - at]:
            return NOT_HERE
        behind = _line_end(received, at + body, end)
        if behind <= 0:
            return WAIT if behind < 0 else NOT_HERE
        found = decode(bytes(received[at:behind]))
        if found is None or found is Damage.CHECKSUM or (found is Damage.VALUE and not is_sealed):
            return NOT_HERE
        return _Seen(behind - at, found)

    return look


def _unwanted(look: Look) -> Look:
    """Return the same look, for messages that are only counted."""

    def seen(received: bytearray, at: int) -> _Seen:
        found = look(received, at)
        return found._replace(found=Counted.OTHER) if found.length > 0 else found

    return seen


def _is_sealed_line(message: ProtocolMessage) -> bool:
    """Return whether lines of other kinds can be told from damaged ones: by start, checksum and end."""
    return bool(message.is_text and message.header and message.check)


def _any_line(message: ProtocolMessage) -> Look:
    """Return the look for any line with the start, the checksum and the end of a message, but its prefix."""
    check, start, prefix, end = message.check, message.header, message.prefix, message.terminator
    assert check is not None
    digits = DIGITS * check.algorithm.size
    seal = re.compile(re.escape(check.mark) + b"([0-9A-Fa-f]{%d})" % digits + re.escape(end))
    begin = 0 if check.over == ALL else len(start)

    def look(received: bytearray, at: int) -> _Seen:
        if received[at : at + len(start)] != start[: len(received) - at]:
            return NOT_HERE
        if received[at : at + len(prefix)] == prefix:
            return NOT_HERE
        behind = _line_end(received, at + len(start), end)
        if behind <= 0:
            return WAIT if behind < 0 else NOT_HERE
        line = bytes(received[at:behind])
        found = seal.search(line, len(line) - digits - len(check.mark) - len(end))
        if found is None or check.algorithm.compute(line[begin : found.start()]) != int(found[1], 16):
            return NOT_HERE
        return _Seen(len(line), Counted.OTHER)

    return look
