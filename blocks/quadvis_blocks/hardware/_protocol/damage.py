"""Counts damaged messages in the bytes that were rejected, however these came in pieces.

A damaged line ends as a whole one does. Binary messages are counted by the length of what was rejected. What
comes before the first message has begun is no damage: the device was there before its reader.
"""

from __future__ import annotations

from quadvis_blocks.hardware._protocol.description import ProtocolMessage


class DamageCount:
    """Counts the damaged messages in rejected bytes."""

    def reject(self, received: bytearray, begin: int, end: int) -> int:
        """Return how many damaged messages end, or begin, in these bytes."""
        raise NotImplementedError

    def close(self) -> int:
        """Return how many more there were before a whole message."""
        raise NotImplementedError


class _LineCount(DamageCount):
    """Counts the ends of lines, and a line that lost its end."""

    def __init__(self, end: bytes) -> None:
        self._end = end
        self._tail = b""  # the last bytes, in which an end may have begun
        self._is_open = False  # bytes have come since the last end
        self._is_first = True

    def reject(self, received: bytearray, begin: int, end: int) -> int:
        ends = self._end
        piece = self._tail + bytes(received[begin:end])
        *lines, rest = piece.split(ends)
        self._tail = rest[-(len(ends) - 1) :] if len(ends) > 1 else b""
        count = 0
        for line in lines:
            count += bool(line.strip() or self._is_open) and not self._is_first
            self._is_open = self._is_first = False
        self._is_open |= bool(rest.strip())
        return count

    def close(self) -> int:
        count = int(self._is_open and not self._is_first)
        self._is_open = self._is_first = False
        self._tail = b""
        return count


class _StretchCount(DamageCount):
    """Counts as many messages as the rejected bytes are long, and one at least."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._rejected = 1 - size  # bytes since the last whole message; before the first one, some are free

    def reject(self, received: bytearray, begin: int, end: int) -> int:
        before = self._count()
        self._rejected += end - begin
        return self._count() - before

    def close(self) -> int:
        self._rejected = 0
        return 0

    def _count(self) -> int:
        return max(1, (2 * self._rejected + self._size) // (2 * self._size)) if self._rejected > 0 else 0


def damage_count(message: ProtocolMessage) -> DamageCount:
    """Return what counts the damaged ones among the messages of a kind."""
    return _LineCount(message.terminator) if message.is_text else _StretchCount(message.size)
