"""Numbers the messages of an output at the moment when they are sent: the sealer of the guardian."""

from __future__ import annotations

import re
import struct
from functools import cached_property

from quadvis_blocks.hardware._protocol.decode import pattern
from quadvis_blocks.hardware._protocol.description import CounterField, ProtocolMessage, ValueField
from quadvis_blocks.hardware._protocol.encode import DIGITS, sealed
from quadvis_blocks.hardware._protocol.forms import Binary


class MessageCounter:
    """Writes the next number into each message, and its checksum anew."""

    def __init__(self, message: ProtocolMessage) -> None:
        self.message = message
        self.added = len(str(message.modulus)) if message.is_text else 0
        self._next = 0

    def seal(self, frame: bytes, now_ns: int) -> bytes:
        """Return a message with the next number."""
        message = self.message
        check, begin = message.check, len(message.header)
        tail = len(message.terminator)
        if check is not None:
            tail += len(check.mark) + check.algorithm.size * (DIGITS if message.is_text else 1)
        first, last, written = self._written(frame)
        self._next = (self._next + 1) % message.modulus
        return sealed(message, frame[begin:first] + written + frame[last : len(frame) - tail])

    def _written(self, frame: bytes) -> tuple[int, int, bytes]:
        """Return where the number stands, and the bytes to be put there."""
        form = self._counter.form
        if isinstance(form, Binary):
            at = len(self.message.header) + self._before
            return at, at + form.size, struct.pack(form.prefix + form.code, self._next)
        match = re.compile(pattern(self.message), re.DOTALL).fullmatch(frame)
        assert match is not None
        return *match.span(self._group), form.print(self._next).strip()

    @cached_property
    def _counter(self) -> CounterField:
        return next(each for each in self.message.fields if isinstance(each, CounterField))

    @cached_property
    def _before(self) -> int:
        """The bytes of the fields before a counter of bytes."""
        fields = self.message.fields
        return sum(each.size for each in fields[: fields.index(self._counter)])

    @cached_property
    def _group(self) -> int:
        """The number of the counter's group in the pattern of a line."""
        fields = self.message.fields
        before = fields[: fields.index(self._counter)]
        return 1 + sum(each.value.count for each in before if isinstance(each, ValueField))
