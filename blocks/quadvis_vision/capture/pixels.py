"""A picture as the record of a capture: its height and width, then its pixels."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

SHAPE = struct.Struct("<2I")
HEADER = SHAPE.size


def packed(pixels: NDArray[np.uint8]) -> tuple[Any, Any]:
    """Return the pieces of a record, of pixels (height, width, 3)."""
    height, width = pixels.shape[:2]
    return SHAPE.pack(height, width), np.ascontiguousarray(pixels).data.cast("B")


def unpacked(payload: memoryview) -> NDArray[np.uint8]:
    """Return the pixels (height, width, 3) of a record; nobody may write into them."""
    height, width = SHAPE.unpack(payload[:HEADER])
    return np.frombuffer(payload, np.uint8, height * width * 3, HEADER).reshape(height, width, 3)
