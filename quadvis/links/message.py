"""Messages: the layout of the signals that one link carries, as bytes.

All numbers are little-endian, without gaps, in the order of the signals: 8 bytes for each float64 and int64,
one for each bool. A picture is its height and width (int64), its stamp (float64, s), its sequence number
(int64) and its pixels (uint8, 3 channels; none if it is not of this kind).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from quadvis.block import NO_FRAME, Frame, Shape
from quadvis.units import Unit

FRAME = "frame"
TYPES = {"float64": "<f8", "int64": "<i8", "bool": "?"}
_HEAD = struct.Struct("<qqdq")  # of a picture
CHANNELS = 3


class MessageSignal(NamedTuple):
    """One signal of a message: its name there, the output that it comes from, and what it is.

    ``nan`` says that NaN means "missing"; ``initial`` is its value (of the shape) before the first message,
    and ``given`` says whether a wire has asked for it.
    """

    name: str
    block: str
    port: str
    scalar: str
    shape: Shape
    units: tuple[Unit, ...]
    nan: bool
    initial: Any
    given: bool = False

    @property
    def source(self) -> str:
        """The output that it comes from, as a diagram writes it."""
        return f"{self.block}.{self.port}"

    @property
    def type(self) -> str:
        """Its type as a declaration writes it."""
        return self.scalar + (f"[{','.join(map(str, self.shape))}]" if self.shape else "")

    @property
    def bytes(self) -> int:
        """Its length; that of a picture without its pixels."""
        if self.scalar == FRAME:
            return _HEAD.size
        return math.prod(self.shape) * np.dtype(TYPES[self.scalar]).itemsize


@dataclass(frozen=True, eq=False)
class Message:
    """The signals that a link carries together, in their order."""

    signals: tuple[MessageSignal, ...]

    @cached_property
    def layout(self) -> str:
        """What both ends must agree on, as text."""
        return " ".join(f"{signal.source}:{signal.type}" for signal in self.signals)

    @cached_property
    def check(self) -> int:
        """CRC-32 of the layout: that of a frame begins with it, so no other layout is ever accepted."""
        return zlib.crc32(self.layout.encode())

    @property
    def id(self) -> int:
        """The number of the message, one byte."""
        return self.check & 0xFF

    @cached_property
    def has_pictures(self) -> bool:
        """Whether a picture is among the signals."""
        return any(signal.scalar == FRAME for signal in self.signals)

    @cached_property
    def size(self) -> int:
        """Number of bytes; pixels are not counted."""
        return sum(signal.bytes for signal in self.signals)

    def room(self, picture: tuple[int, int]) -> int:
        """Return the largest number of bytes, with pictures of up to this height and width (px)."""
        count = sum(signal.scalar == FRAME for signal in self.signals)
        return self.size + count * picture[0] * picture[1] * CHANNELS

    def pack(self, values: Sequence[Any]) -> bytes:
        """Return the values of all signals as bytes."""
        return b"".join(
            _picture_bytes(value)
            if signal.scalar == FRAME
            else np.asarray(value, TYPES[signal.scalar]).tobytes()
            for signal, value in zip(self.signals, values, strict=True)
        )

    def unpack(self, data: bytes) -> tuple[Any, ...]:
        """Return the values of all signals: Python scalars, read-only arrays, pictures.

        ValueError if the bytes are too few or too many.
        """
        values: list[Any] = []
        place = 0
        for signal in self.signals:
            if signal.scalar == FRAME:
                picture, place = _picture(data, place)
                values.append(picture)
                continue
            count = math.prod(signal.shape)
            found = np.frombuffer(data, TYPES[signal.scalar], count, place)
            values.append(found.reshape(signal.shape) if signal.shape else found[0].item())
            place += signal.bytes
        if place != len(data):
            raise ValueError(f"the message has {place} bytes, not {len(data)}")
        return tuple(values)


def _picture_bytes(frame: Frame) -> bytes:
    """Return a picture as bytes; of one that is none, such as a grey one, its stamp and no pixels."""
    pixels = frame.pixels
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != CHANNELS:
        pixels = NO_FRAME.pixels
    height, width = pixels.shape[:2]
    return _HEAD.pack(height, width, frame.stamp, frame.sequence) + pixels.tobytes()


def _picture(data: bytes, place: int) -> tuple[Frame, int]:
    height, width, stamp, sequence = _HEAD.unpack_from(data, place)
    start = place + _HEAD.size
    pixels = np.frombuffer(data, np.uint8, height * width * CHANNELS, start)
    return Frame(pixels.reshape(height, width, CHANNELS), stamp, sequence), start + pixels.size
